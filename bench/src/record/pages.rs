//! The pages of measured results, as `pages.toml` beside this file declares them.

use serde::Deserialize;
use std::io;

/// Pages that one command makes anew.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordPart {
    /// Its name.
    pub name: String,
    /// The content of its pages.
    pub about: String,
    /// Usual time on two idle cores; none if it has not been seen.
    #[serde(default)]
    pub minutes: Option<f64>,
    /// Built-in hands that it plays.
    #[serde(default)]
    pub hands: Vec<String>,
    /// Built-in tasks that it plays.
    #[serde(default)]
    pub tasks: Vec<String>,
    /// Files and folders of controllers, from the root of the repository.
    #[serde(default)]
    pub controllers: Vec<String>,
    /// Cases of this crate that it plays.
    #[serde(default)]
    pub cases: Vec<String>,
    /// Their steps, ms.
    #[serde(default)]
    pub steps_ms: Vec<f64>,
    /// Its pages, from the root of the repository.
    pub pages: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Declared {
    part: Vec<RecordPart>,
}

/// The record cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// No such part.
    #[error("no part `{0}`; parts: {1}")]
    Part(String, String),
    /// A part names a hand or task that is not built in.
    #[error("bench/src/record/pages.toml: part `{part}`: {kind} `{name}` is not built in")]
    NotBuiltIn {
        /// The part.
        part: String,
        /// Hand or task.
        kind: &'static str,
        /// Its name.
        name: String,
    },
    /// A controller's file cannot be read.
    #[error("bench/src/record/pages.toml: part `{part}`: {path}: {source}")]
    Controller {
        /// The part.
        part: String,
        /// The file or folder.
        path: String,
        /// The reason.
        source: io::Error,
    },
}

/// All parts, in the order of the file.
pub fn parts() -> Vec<RecordPart> {
    let declared: Declared = toml::from_str(include_str!("pages.toml")).expect("pages.toml is valid");
    declared.part
}

/// The part of a name.
pub(super) fn part(name: &str) -> Result<RecordPart, RecordError> {
    let parts = parts();
    let names = parts.iter().map(|part| &*part.name).collect::<Vec<_>>().join(", ");
    let found = parts.into_iter().find(|part| part.name == name);
    found.ok_or_else(|| RecordError::Part(name.to_owned(), names))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases;

    #[test]
    fn cases_of_parts_exist_and_names_are_unique() {
        let parts = parts();
        for part in &parts {
            assert_eq!(parts.iter().filter(|other| other.name == part.name).count(), 1, "{}", part.name);
            assert!(part.minutes.is_none_or(|minutes| minutes > 0.0), "{}: no time", part.name);
            for name in &part.cases {
                assert!(cases::all().any(|case| case.name == name), "{}: no case `{name}`", part.name);
            }
        }
    }
}
