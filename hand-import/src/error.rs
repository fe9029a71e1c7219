//! Reasons why nothing can be imported.

use std::path::PathBuf;

use palmares_models::error::ModelError;

/// Reason why a source gives no hand at all. Smaller faults are decisions of kind `problem`.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file cannot be read, is not well-formed or exceeds a limit.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The file has no content that a reader knows.
    #[error("{}: {problem}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The problem and its remedy.
        problem: String,
    },
    /// The source has several robots.
    #[error("{}: there are {} robots; choose one with --robot: {}", source_path.display(), robots.len(), robots.join(", "))]
    Several {
        /// The source.
        source_path: PathBuf,
        /// Paths of their files in the source.
        robots: Vec<String>,
    },
    /// Nothing can be written.
    #[error("{}: {source}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

impl ImportError {
    /// An unreadable file.
    pub fn unreadable(file: impl Into<PathBuf>, problem: impl Into<String>) -> ImportError {
        ImportError::Unreadable { file: file.into(), problem: problem.into() }
    }
}
