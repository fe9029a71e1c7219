//! Addresses of documents, and the addresses that their links lead to on this server.

use std::collections::BTreeSet;

/// Address of the first document.
pub const ROOT: &str = "/docs";

/// The address that documents have for a practice server; a reader of these pages has one already.
const PRACTICE_SERVER: &str = "http://127.0.0.1:8080";

/// The address of a document, by its path in the repository: `docs/teams.md` is at `/docs/teams`.
pub(super) fn address(path: &str) -> String {
    let name = path.strip_suffix(".md").unwrap_or(path);
    let name = name.strip_suffix("README").unwrap_or(name).trim_end_matches('/');
    let name = name.strip_prefix("docs/").unwrap_or(name);
    if name.is_empty() { ROOT.to_owned() } else { format!("{ROOT}/{}", name.to_ascii_lowercase()) }
}

/// Where a link leads.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// An address.
    Address(String),
    /// A file or folder that this server does not have, by its path in the repository.
    Elsewhere(String),
}

/// The files that this server has.
pub(super) struct Places(BTreeSet<&'static str>);

impl Places {
    pub(super) fn of(paths: impl Iterator<Item = &'static str>) -> Self {
        Places(paths.collect())
    }

    /// Where `link` leads in the document `from`, which is a path in the repository.
    pub(super) fn target(&self, from: &str, link: &str) -> Target {
        if let Some(path) = link.strip_prefix(PRACTICE_SERVER) {
            return Target::Address(if path.is_empty() { "/".to_owned() } else { path.to_owned() });
        }
        if link.starts_with('#') || link.contains("://") || link.starts_with("mailto:") {
            return Target::Address(link.to_owned());
        }
        let (relative, id) = link.split_once('#').map_or((link, None), |(path, id)| (path, Some(id)));
        let mut parts: Vec<&str> = from.split('/').collect();
        parts.pop();
        for part in relative.split('/') {
            match part {
                "." | "" => {}
                ".." => drop(parts.pop()),
                part => parts.push(part),
            }
        }
        let path = parts.join("/");
        if !self.0.contains(path.as_str()) {
            return Target::Elsewhere(path);
        }
        Target::Address(match (path.ends_with(".md"), id) {
            (true, Some(id)) => format!("{}#{id}", address(&path)),
            (true, None) => address(&path),
            (false, _) => format!("{ROOT}/files/{path}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn documents_have_short_addresses() {
        for (path, wanted) in [
            ("README.md", "/docs"),
            ("docs/teams.md", "/docs/teams"),
            ("ARCHITECTURE.md", "/docs/architecture"),
            ("models/hands/softhand/README.md", "/docs/models/hands/softhand"),
        ] {
            assert_eq!(address(path), wanted);
        }
    }

    #[test]
    fn links_lead_to_pages_files_or_nowhere() {
        let places = Places::of(["README.md", "docs/teams.md", "docs/pictures/a.png"].into_iter());
        let to = |from: &str, link: &str| places.target(from, link);
        let address = |text: &str| Target::Address(text.to_owned());
        assert_eq!(to("README.md", "docs/teams.md#scores"), address("/docs/teams#scores"));
        assert_eq!(to("docs/teams.md", "../README.md"), address("/docs"));
        assert_eq!(to("docs/teams.md", "pictures/a.png"), address("/docs/files/docs/pictures/a.png"));
        assert_eq!(to("docs/teams.md", "#scores"), address("#scores"));
        assert_eq!(to("README.md", "https://mcap.dev/spec"), address("https://mcap.dev/spec"));
        assert_eq!(to("README.md", "http://127.0.0.1:8080/live"), address("/live"));
        assert_eq!(to("docs/teams.md", "../sim/src/world.rs"), Target::Elsewhere("sim/src/world.rs".into()));
    }
}
