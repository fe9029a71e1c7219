//! XML of bounded size, checked before it is parsed: parsers recurse, and compare attributes with each other.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use crate::error::ModelError;
use crate::read::limits::Limits;
use crate::read::report::Report;

/// Well-formed XML of bounded size and nesting; later parsers recurse.
pub(crate) fn document<'a>(
    text: &'a str,
    limits: &Limits,
    report: &Report,
) -> Result<Document<'a>, ModelError> {
    check_tags(text, limits, report)?;
    let options = ParsingOptions { nodes_limit: limits.xml_nodes, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| match e {
        roxmltree::Error::NodesLimitReached => {
            let limit = u64::from(limits.xml_nodes);
            report.too_large("robot", "XML nodes and more", limit + 1, limit)
        }
        e => report.syntax("XML", e),
    })?;
    let mut open = vec![(document.root_element(), 1_usize)];
    while let Some((node, depth)) = open.pop() {
        let element = format!("<{}>", node.tag_name().name());
        report.limit(element, "nested XML elements", depth, limits.xml_depth)?;
        open.extend(node.children().filter(Node::is_element).map(|child| (child, depth + 1)));
    }
    Ok(document)
}

/// Well-formed XML of bounded size and nesting; `file` is its name in messages.
///
/// # Errors
/// It is not well-formed, or larger than the limits allow.
pub fn xml<'a>(file: &Path, text: &'a str, limits: &Limits) -> Result<Document<'a>, ModelError> {
    document(text, limits, &Report::new(file))
}

/// Rejects a tag that is longer than the limit. Comments may have any length.
fn check_tags(text: &str, limits: &Limits, report: &Report) -> Result<(), ModelError> {
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let comment = rest.starts_with("<!--");
        let length = if comment { rest.find("-->") } else { tag_length(rest) };
        // An unterminated tag counts to the end of the file; the parser reports the problem.
        let length = length.unwrap_or(rest.len());
        if !comment {
            let name: String = rest[1..].chars().take_while(|c| c.is_alphanumeric()).take(40).collect();
            report.limit(format!("<{name}>"), "bytes in one tag", length, limits.tag_bytes)?;
        }
        rest = &rest[length..];
        // At least past the '<'.
        let mut after = rest.char_indices().skip(1);
        rest = after.next().map_or("", |(i, _)| &rest[i..]);
    }
    Ok(())
}

/// Bytes from `<` to the `>` outside quotes.
fn tag_length(text: &str) -> Option<usize> {
    let mut quote = None;
    for (i, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(i),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), byte) if open == byte => quote = None,
            _ => {}
        }
    }
    None
}
