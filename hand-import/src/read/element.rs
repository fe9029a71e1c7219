//! XML elements that own their text: a format's `<include>` can replace one by those of another file.

use std::path::Path;
use std::rc::Rc;

use roxmltree::{Document, Node, ParsingOptions};

use crate::decision::{At, Log};

/// Largest number of nodes of a file.
const MAX_NODES: u32 = 400_000;
/// Largest number of elements inside each other.
const MAX_DEPTH: usize = 128;

/// An element with its attributes and child elements.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Element>,
    /// Text before its first child, trimmed.
    pub(crate) text: String,
    /// The file that has it.
    pub(crate) file: Rc<Path>,
    /// Its line, from 1.
    pub(crate) line: u32,
}

impl Element {
    /// An attribute's value.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// The first child of that name.
    pub(crate) fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Children of that name.
    pub(crate) fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Element> + 'a {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Text of the first child of that name.
    pub(crate) fn child_text(&self, name: &str) -> Option<&str> {
        self.child(name).map(|child| child.text.as_str())
    }

    /// The element for messages: `joint 'knuckle' (line 12)`.
    pub(crate) fn label(&self) -> String {
        match self.get("name") {
            Some(name) => format!("{} '{name}'", self.name),
            None => format!("{} (line {})", self.name, self.line),
        }
    }
}

/// The root element of a text.
///
/// # Errors
/// The text is no XML, has a document type, too many nodes or too many elements inside each other.
pub(crate) fn parse(file: &Path, text: &str) -> Result<Element, String> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..Default::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| error.to_string())?;
    let ends: Vec<usize> =
        text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect();
    owned(document.root_element(), (&Rc::from(file), &ends), 0)
}

/// `ends`: places of the ends of lines. The XML library would count them again for each element.
fn owned(node: Node<'_, '_>, (file, ends): (&Rc<Path>, &[usize]), depth: usize) -> Result<Element, String> {
    if depth > MAX_DEPTH {
        return Err(format!("more than {MAX_DEPTH} elements are inside each other"));
    }
    let children = node.children().filter(Node::is_element);
    let start = node.range().start;
    Ok(Element {
        name: node.tag_name().name().to_owned(),
        attributes: node.attributes().map(|a| (a.name().to_owned(), a.value().to_owned())).collect(),
        children: children.map(|child| owned(child, (file, ends), depth + 1)).collect::<Result<_, _>>()?,
        text: node.text().unwrap_or_default().trim().to_owned(),
        file: Rc::clone(file),
        line: (ends.partition_point(|end| *end < start) + 1) as u32,
    })
}

/// Decisions about elements.
pub(crate) trait Notes {
    /// The element is wrong.
    fn bad(&mut self, element: &Element, text: impl Into<String>);
    /// The element states something that a hand has no place for.
    fn lost(&mut self, at: At, element: &Element, text: impl Into<String>);
    /// The element states it in other words.
    fn kept(&mut self, at: At, element: &Element, text: impl Into<String>);
    /// The element does not state it.
    fn chose(&mut self, at: At, element: &Element, text: impl Into<String>);
}

impl Notes for Log {
    fn bad(&mut self, element: &Element, text: impl Into<String>) {
        in_file(self, element, |log| log.problem(At::Hand, element.label(), text));
    }

    fn lost(&mut self, at: At, element: &Element, text: impl Into<String>) {
        in_file(self, element, |log| log.dropped(at, element.label(), text));
    }

    fn kept(&mut self, at: At, element: &Element, text: impl Into<String>) {
        in_file(self, element, |log| log.taken(at, element.label(), text));
    }

    fn chose(&mut self, at: At, element: &Element, text: impl Into<String>) {
        in_file(self, element, |log| log.guessed(at, element.label(), text));
    }
}

/// The element's file may be one that the main file includes.
fn in_file(log: &mut Log, element: &Element, add: impl FnOnce(&mut Log)) {
    let main = std::mem::replace(&mut log.file, element.file.to_path_buf());
    add(log);
    log.file = main;
}
