//! The documents, each with its place in the list beside the text.

use super::links::{Places, address};
use super::render::{Heading, render};
use super::sources::File;

/// A document.
#[derive(Debug)]
pub struct Document {
    /// Path in the repository.
    pub path: &'static str,
    /// Address of its page.
    pub address: String,
    /// Its first heading.
    pub title: String,
    /// Its text as HTML.
    pub html: String,
    /// Its headings, in order.
    pub headings: Vec<Heading>,
    /// Its text without marks, one for the part before the first heading and one for each heading.
    pub(super) sections: Vec<String>,
}

/// A group of documents in the list beside the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// The README, and what is in `docs/`.
    Guides,
    /// Hands and objects.
    Models,
    /// How the project is built and changed.
    Project,
}

impl Group {
    /// All groups, in the order of the list.
    pub const ALL: [Group; 3] = [Group::Guides, Group::Models, Group::Project];

    /// Its heading.
    pub fn title(self) -> &'static str {
        match self {
            Group::Guides => "Guides",
            Group::Models => "Hands and objects",
            Group::Project => "The project",
        }
    }
}

impl Document {
    /// The group of this document.
    pub fn group(&self) -> Group {
        match self.path.split('/').next() {
            Some("README.md" | "docs" | "client-py") => Group::Guides,
            Some("models") => Group::Models,
            _ => Group::Project,
        }
    }
}

/// All documents and files.
#[derive(Debug)]
pub struct Library {
    /// In the order of the README's table of documents; others follow, by path.
    pub documents: Vec<Document>,
    files: Vec<File>,
}

impl Library {
    /// The documents of these files.
    pub(super) fn of(files: Vec<File>) -> Self {
        let places = Places::of(files.iter().map(|file| file.path));
        let texts: Vec<(&'static str, String)> = files
            .iter()
            .filter(|file| file.path.ends_with(".md"))
            .map(|file| (file.path, file.text()))
            .collect();
        let first = texts.iter().find(|(path, _)| *path == "README.md");
        let place = first.map_or("", |(_, text)| text);
        let mut documents: Vec<Document> = texts
            .iter()
            .map(|(path, text)| {
                let rendered = render(text, path, &places);
                let address = address(path);
                let title = rendered.headings.first().map_or_else(|| (*path).to_owned(), |h| h.text.clone());
                let (html, headings, sections) = (rendered.html, rendered.headings, rendered.sections);
                Document { path, address, title, html, headings, sections }
            })
            .collect();
        let rank = |path: &str| match path {
            "README.md" => Some(0),
            // Its table of documents is at its end.
            path => place.rfind(&format!("({path})")),
        };
        documents.sort_by_key(|document| (rank(document.path).unwrap_or(usize::MAX), document.path));
        Library { documents, files }
    }

    /// The document with this address.
    pub fn document(&self, address: &str) -> Option<&Document> {
        self.documents.iter().find(|document| document.address == address)
    }

    /// The file with this path in the repository.
    pub fn file(&self, path: &str) -> Option<&File> {
        self.files.iter().find(|file| file.path == path && !path.ends_with(".md"))
    }
}
