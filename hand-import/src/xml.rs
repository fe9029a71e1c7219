//! Attributes and child elements of XML, with a problem in the log where a number is none.

use roxmltree::Node;

use crate::decision::{At, Log};
use crate::numbers::numbers;

/// The first child element of that name.
pub(crate) fn child<'a, 'input>(node: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    children(node, tag).next()
}

/// The child elements of that name; names have no namespace.
pub(crate) fn children<'a, 'input>(
    node: Node<'a, 'input>,
    tag: &str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(move |child| child.is_element() && child.tag_name().name() == tag)
}

/// Trimmed text of the first child of that name.
pub(crate) fn child_text<'a>(node: Node<'a, '_>, tag: &str) -> Option<&'a str> {
    child(node, tag)?.text().map(str::trim).filter(|text| !text.is_empty())
}

/// The element that a decision names, and the place of its comment.
pub(crate) struct Element<'a> {
    /// As in messages: `link 'palm'`.
    pub(crate) name: &'a str,
    /// Place of the comment.
    pub(crate) at: At,
    /// Where problems go.
    pub(crate) log: &'a mut Log,
}

impl Element<'_> {
    /// The number in a text; anything else is a problem, and `None`.
    pub(crate) fn number(&mut self, what: &str, text: &str) -> Option<f64> {
        let number = text.trim().parse().ok().filter(|x: &f64| x.is_finite());
        if number.is_none() {
            let text: String = text.chars().take(40).collect();
            self.log.problem(
                self.at.clone(),
                self.name,
                format!("{what} is '{text}', no finite number; not read"),
            );
        }
        number
    }

    /// The number in an attribute, if it is there.
    pub(crate) fn attribute(&mut self, node: Node<'_, '_>, name: &str) -> Option<f64> {
        let text = node.attribute(name)?;
        self.number(&format!("{name} of <{}>", node.tag_name().name()), text)
    }

    /// The `N` numbers in an attribute, if it is there.
    pub(crate) fn numbers<const N: usize>(&mut self, node: Node<'_, '_>, name: &str) -> Option<[f64; N]> {
        let text = node.attribute(name)?;
        let what = format!("{name} of <{}>", node.tag_name().name());
        self.list(&what, text)
    }

    /// The `N` numbers in a text; anything else is a problem, and `None`.
    pub(crate) fn list<const N: usize>(&mut self, what: &str, text: &str) -> Option<[f64; N]> {
        let list = numbers(text).and_then(|found| <[f64; N]>::try_from(found).ok());
        if list.is_none() {
            let text: String = text.chars().take(40).collect();
            let problem =
                format!("{what} is '{text}'; valid: {N} finite numbers with spaces between them; not read");
            self.log.problem(self.at.clone(), self.name, problem);
        }
        list
    }
}
