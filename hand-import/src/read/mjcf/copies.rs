//! Names of what `<replicate>` copies, and copies of what refers to them.

use std::collections::BTreeMap;

use crate::read::element::Element;

/// Largest number of elements that copies have together.
pub(super) const MOST_COPIES: usize = 10_000;
/// Sections whose elements are copied with what they name.
const SECTIONS: [&str; 4] = ["tendon", "actuator", "equality", "contact"];
/// Attributes that name an element of the tree, or a tendon.
const REFERENCES: [&str; 14] = [
    "joint",
    "jointinparent",
    "joint1",
    "joint2",
    "body1",
    "body2",
    "site",
    "site1",
    "site2",
    "sidesite",
    "geom",
    "geom1",
    "geom2",
    "tendon",
];

/// The copies that were made.
#[derive(Clone, Debug, Default)]
pub(super) struct Copies {
    /// Elements of all copies.
    pub(super) made: usize,
    /// End of the names in the copy that is being read.
    pub(super) suffix: String,
    /// Ends of the copies of a name.
    of: BTreeMap<String, Vec<String>>,
}

impl Copies {
    /// The name in the copy that is being read.
    pub(super) fn name(&mut self, name: &str) -> String {
        if self.suffix.is_empty() {
            return name.to_owned();
        }
        let ends = self.of.entry(name.to_owned()).or_default();
        if !ends.contains(&self.suffix) {
            ends.push(self.suffix.clone());
        }
        format!("{name}{}", self.suffix)
    }

    /// The document with a copy of each tendon, actuator, equality and exclusion for each copy of what it names.
    pub(super) fn expanded(&mut self, root: &Element) -> Element {
        let mut root = root.clone();
        if self.of.is_empty() {
            return root;
        }
        for name in SECTIONS {
            for section in root.children.iter_mut().filter(|section| section.name == name) {
                let elements = std::mem::take(&mut section.children);
                section.children = elements.into_iter().flat_map(|element| self.copied(element)).collect();
            }
        }
        root
    }

    fn copied(&mut self, element: Element) -> Vec<Element> {
        let mut names = Vec::new();
        collect(&element, &mut names);
        let Some(ends) = names.iter().find_map(|name| self.of.get(name)).cloned() else {
            return vec![element];
        };
        if let Some(name) = element.get("name") {
            self.of.insert(name.to_owned(), ends.clone());
        }
        self.made = self.made.saturating_add(ends.len().saturating_mul(size(&element)));
        if self.made > MOST_COPIES {
            return vec![element];
        }
        let copy = |end: &String| {
            let mut copy = element.clone();
            self.rename(&mut copy, end);
            if let Some((_, name)) = copy.attributes.iter_mut().find(|(key, _)| key == "name") {
                name.push_str(end);
            }
            copy
        };
        ends.iter().map(copy).collect()
    }

    fn rename(&self, element: &mut Element, end: &str) {
        for (key, name) in &mut element.attributes {
            let copied = self.of.get(name.as_str()).is_some_and(|ends| ends.iter().any(|other| other == end));
            if REFERENCES.contains(&key.as_str()) && copied {
                name.push_str(end);
            }
        }
        element.children.iter_mut().for_each(|child| self.rename(child, end));
    }
}

/// Number of copies that a `<replicate>` wants.
pub(super) fn copies(element: &Element) -> usize {
    element.get("count").and_then(|text| text.trim().parse().ok()).unwrap_or(0)
}

/// Elements in it, with the copies of all `<replicate>`.
pub(super) fn size(element: &Element) -> usize {
    let inner = element.children.iter().fold(1, |sum: usize, child| sum.saturating_add(size(child)));
    if element.name == "replicate" { inner.saturating_mul(copies(element)) } else { inner }
}

fn collect(element: &Element, names: &mut Vec<String>) {
    let references = element.attributes.iter().filter(|(key, _)| REFERENCES.contains(&key.as_str()));
    names.extend(references.map(|(_, name)| name.clone()));
    element.children.iter().for_each(|child| collect(child, names));
}
