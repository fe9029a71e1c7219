//! The repository's documents for their readers in a browser: rendered once, at the first request.

mod links;
mod render;
mod search;
mod sources;

use links::Places;
pub(crate) use render::Heading;
pub(crate) use search::{Hit, MOST, search};
pub(crate) use sources::File;
use std::sync::LazyLock;

/// Address of the first document.
pub(crate) const ROOT: &str = "/docs";

/// A document.
#[derive(Debug)]
pub(crate) struct Document {
    /// Path in the repository.
    pub(crate) path: &'static str,
    /// Address of its page.
    pub(crate) address: String,
    /// Its first heading.
    pub(crate) title: String,
    /// Its text as HTML.
    pub(crate) html: String,
    /// Its headings, in order.
    pub(crate) headings: Vec<Heading>,
    /// Its text without marks, one for the part before the first heading and one for each heading.
    sections: Vec<String>,
}

/// A group of documents in the list beside the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Group {
    /// The README, and what is in `docs/`.
    Guides,
    /// Hands and objects.
    Models,
    /// How the project is built and changed.
    Project,
}

impl Group {
    /// All groups, in the order of the list.
    pub(crate) const ALL: [Group; 3] = [Group::Guides, Group::Models, Group::Project];

    /// Its heading.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Group::Guides => "Guides",
            Group::Models => "Hands and objects",
            Group::Project => "The project",
        }
    }
}

impl Document {
    /// The group of this document.
    pub(crate) fn group(&self) -> Group {
        match self.path.split('/').next() {
            Some("README.md" | "docs" | "client-py") => Group::Guides,
            Some("models") => Group::Models,
            _ => Group::Project,
        }
    }
}

/// All documents and files.
#[derive(Debug)]
pub(crate) struct Library {
    /// In the order of the README's table of documents; others follow, by path.
    pub(crate) documents: Vec<Document>,
    files: Vec<File>,
}

impl Library {
    fn of(files: Vec<File>) -> Self {
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
                let rendered = render::render(text, path, &places);
                let address = links::address(path);
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
    pub(crate) fn document(&self, address: &str) -> Option<&Document> {
        self.documents.iter().find(|document| document.address == address)
    }

    /// The file with this path in the repository.
    pub(crate) fn file(&self, path: &str) -> Option<&File> {
        self.files.iter().find(|file| file.path == path && !path.ends_with(".md"))
    }
}

/// The documents that this program was built with; none if it was built without them.
pub(crate) fn library() -> &'static Library {
    static LIBRARY: LazyLock<Library> = LazyLock::new(|| Library::of(sources::embedded()));
    &LIBRARY
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of an attribute in HTML.
    fn values<'a>(html: &'a str, name: &str) -> impl Iterator<Item = &'a str> + use<'a> {
        let mark = format!(" {name}=\"");
        let parts: Vec<&str> = html.split(&mark).skip(1).collect();
        parts.into_iter().filter_map(|rest| rest.split('"').next())
    }

    #[test]
    fn every_link_between_documents_leads_to_a_page_and_a_heading() {
        let library = library();
        assert!(library.documents.len() > 30, "{}", library.documents.len());
        let (mut checked, mut wrong) = (0, Vec::new());
        for document in &library.documents {
            for link in values(&document.html, "href").chain(values(&document.html, "src")) {
                let (page, id) = link.split_once('#').unwrap_or((link, ""));
                if let Some(path) = page.strip_prefix("/docs/files/") {
                    checked += 1;
                    if library.file(path).is_none() {
                        wrong.push(format!("{}: {link}", document.path));
                    }
                } else if page.is_empty() || page.starts_with(ROOT) {
                    checked += 1;
                    let to = if page.is_empty() { Some(document) } else { library.document(page) };
                    let is_there = |to: &Document| id.is_empty() || to.headings.iter().any(|h| h.id == id);
                    if !to.is_some_and(is_there) {
                        wrong.push(format!("{}: {link}", document.path));
                    }
                }
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
        assert!(checked > 200, "{checked}");
    }

    #[test]
    fn only_records_of_measurements_and_folders_are_left_out() {
        let mut missing: Vec<String> = Vec::new();
        for document in &library().documents {
            let marks = document.html.split("<span class=\"elsewhere\" title=\"").skip(1);
            missing.extend(marks.filter_map(|rest| Some(rest.split_once(',')?.0.to_owned())));
        }
        let records = ["docs/report", "docs/validation", "docs/training"];
        missing.retain(|path| !records.iter().any(|record| path.starts_with(record)));
        // Folders have no page of their own.
        missing.retain(|path| path.rsplit('/').next().is_some_and(|name| name.contains('.')));
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn the_list_has_the_order_of_the_readme() {
        let paths: Vec<&str> = library().documents.iter().map(|document| document.path).collect();
        assert_eq!(paths[0], "README.md");
        assert_eq!(paths[1], "docs/teams.md");
        let at = |wanted: &str| paths.iter().position(|path| *path == wanted).expect(wanted);
        assert!(at("docs/protocol.md") < at("ARCHITECTURE.md"), "{paths:?}");
        assert!(at("SECURITY.md") < at("models/objects/README.md"), "{paths:?}");
    }
}
