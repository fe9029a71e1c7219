//! The repository's documents for their readers in a browser: rendered once, at the first request.

mod library;
mod links;
mod render;
mod search;
mod sources;

pub use library::{Document, Group, Library};
pub use links::ROOT;
use search::Finder;
pub use search::{Found, Hit, MOST};
use std::sync::LazyLock;

/// The documents that this program was built with; none if it was built without them.
pub fn library() -> &'static Library {
    static LIBRARY: LazyLock<Library> = LazyLock::new(|| Library::of(sources::embedded()));
    &LIBRARY
}

/// The sections with the words of `query`, the best first.
pub fn search(query: &str) -> Found<'static> {
    static FINDER: LazyLock<Finder<'static>> = LazyLock::new(|| Finder::of(library()));
    FINDER.search(query)
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
