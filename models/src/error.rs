//! Errors and warnings about a description.

use std::path::PathBuf;

/// Reason why a hand or an object could not be built.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file does not exist or is not readable.
    #[error("{}: {error}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Error of the operating system. It is no `source`: a chain of errors would print it twice.
        error: std::io::Error,
    },
    /// The file exceeds a limit that no sound description needs; it may be hostile.
    #[error("{}: {element}: {found} {what}; the limit is {limit}", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Element: `link 'palm'`.
        element: String,
        /// Counted quantity.
        what: &'static str,
        /// Count, up to where counting stopped.
        found: u64,
        /// Largest allowed count.
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
    /// The file is well-formed, but an element is invalid.
    #[error("{}: {element}: {problem}; valid: {valid}", file.display())]
    Element {
        /// The file.
        file: PathBuf,
        /// Element: `joint 'index_abd'`.
        element: String,
        /// The problem.
        problem: String,
        /// Valid values.
        valid: String,
    },
    /// A finished description contradicts itself.
    #[error("{name}: {element}: {problem}")]
    Inconsistent {
        /// Name of the hand or object, or of the file that states the element.
        name: String,
        /// The inconsistent part.
        element: String,
        /// The problem.
        problem: String,
    },
    /// Several problems of one description, one a line.
    #[error("{}", lines(.0))]
    Several(Vec<ModelError>),
}

fn lines(errors: &[ModelError]) -> String {
    errors.iter().map(ModelError::to_string).collect::<Vec<_>>().join("\n")
}

/// The problems of a description that could not be loaded, and the warnings up to there.
#[derive(Debug)]
pub struct Refused {
    /// The problems, at least one.
    pub errors: Vec<ModelError>,
    /// Warnings for the author.
    pub warnings: Vec<LoadWarning>,
}

impl From<ModelError> for Refused {
    fn from(error: ModelError) -> Refused {
        Refused { errors: vec![error], warnings: Vec::new() }
    }
}

impl Refused {
    /// The problems as one error.
    pub fn into_error(self) -> ModelError {
        let mut errors = self.errors;
        match errors.len() {
            1 => errors.remove(0),
            _ => ModelError::Several(errors),
        }
    }
}

impl ModelError {
    /// The faulty file, if the error knows it.
    pub fn file(&self) -> Option<&str> {
        match self {
            ModelError::Several(errors) => errors.first().and_then(ModelError::file),
            ModelError::Read { file, .. }
            | ModelError::TooLarge { file, .. }
            | ModelError::Syntax { file, .. }
            | ModelError::Element { file, .. } => file.to_str(),
            ModelError::Inconsistent { .. } => None,
        }
    }
}

/// Something that a loader accepted but that its author should know.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {element}: {message}", file.display())]
pub struct LoadWarning {
    /// The file.
    pub file: PathBuf,
    /// Element: `link 'index_distal'`.
    pub element: String,
    /// The oddity, and how it was handled.
    pub message: String,
}
