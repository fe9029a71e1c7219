//! Names of elements, and elements that are not read.

use roxmltree::Node;

use super::super::reading::Reading;
use crate::decision::At;

/// The name of a link or a joint, or its place in the file if it has none.
pub(super) fn named(node: Node<'_, '_>, reading: &mut Reading<'_>) -> String {
    if let Some(name) = node.attribute("name").filter(|name| !name.trim().is_empty()) {
        return name.to_owned();
    }
    let tag = node.tag_name().name();
    let line = node.document().text_pos_at(node.range().start).row;
    let name = format!("{tag}_of_line_{line}");
    reading.log.problem(At::Hand, format!("{tag} of line {line}"), format!("has no name; taken is '{name}'"));
    name
}

/// Names the child elements that are not read, once for all elements of the kind.
pub(super) fn unread(node: Node<'_, '_>, read: &[&str], kind: &str, reading: &mut Reading<'_>) {
    for other in node.children().filter(Node::is_element).map(|child| child.tag_name().name()) {
        if !read.contains(&other) {
            reading.log.dropped(At::Hand, format!("<{other}> of a {kind}"), "has no place in a hand");
        }
    }
}
