//! What can be wrong with a description, and what is merely odd about it.

use std::path::PathBuf;

/// Why a hand or an object could not be built.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file is not there or not readable.
    #[error("{}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file asks for more than a description needs; it may be hostile.
    #[error("{}: {element}: {found} {what}; the limit is {limit}", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Which element: `link 'palm'`.
        element: String,
        /// What there is too much of.
        what: &'static str,
        /// How much, as far as counted.
        found: u64,
        /// How much is allowed.
        limit: u64,
    },
    /// The file is not well-formed XML, URDF, TOML or STL.
    #[error("{}: not valid {format}: {message}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// `XML`, `URDF`, `TOML`, `STL`.
        format: &'static str,
        /// The parser's message.
        message: String,
    },
    /// The file is well-formed but one element cannot be meant.
    #[error("{}: {element}: {problem}; valid: {valid}", file.display())]
    Element {
        /// The file.
        file: PathBuf,
        /// Which element: `joint 'index_abd'`.
        element: String,
        /// What is wrong with it.
        problem: String,
        /// What would be right.
        valid: String,
    },
    /// A finished description contradicts itself.
    #[error("{name}: {element}: {problem}")]
    Inconsistent {
        /// Name of the hand or object, or of the file that states the element.
        name: String,
        /// Which part of it.
        element: String,
        /// What is wrong with it.
        problem: String,
    },
}

impl ModelError {
    /// The file that is wrong, where the error knows it.
    pub fn file(&self) -> Option<&str> {
        match self {
            ModelError::Read { file, .. }
            | ModelError::TooLarge { file, .. }
            | ModelError::Syntax { file, .. }
            | ModelError::Element { file, .. } => file.to_str(),
            ModelError::Inconsistent { .. } => None,
        }
    }
}

/// Something a loader accepted but that its author should know of.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {element}: {message}", file.display())]
pub struct LoadWarning {
    /// The file.
    pub file: PathBuf,
    /// Which element: `link 'index_distal'`.
    pub element: String,
    /// What is odd, and what was done about it.
    pub message: String,
}
