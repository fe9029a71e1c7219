//! Failures of the database.

use palmares_protocol::{Code, Refusal};
use std::path::PathBuf;

/// A failure of the database.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StoreError {
    /// The URL names a database that is not supported.
    #[error(
        "database URL `{url}`: {why}; use sqlite:///path/to/palmares.sqlite or postgres://user@host/database"
    )]
    Url {
        /// The URL's scheme only: the rest may contain a password.
        url: String,
        /// The problem.
        why: String,
    },
    /// Another server uses the database.
    #[error(
        "the database {place} is in use by another server; choose another with --data-dir or --database-url"
    )]
    Taken {
        /// The database.
        place: String,
    },
    /// The data directory cannot be created or written.
    #[error("cannot write in the data directory {}: {source}; choose another with --data-dir", path.display())]
    Folder {
        /// The directory.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The database cannot be opened.
    #[error("cannot open the database {place}: {source}")]
    Open {
        /// The database.
        place: String,
        /// The database's error.
        source: sqlx::Error,
    },
    /// The schema could not be migrated.
    #[error("cannot bring the database up to date: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A query failed.
    #[error("database: {0}")]
    Query(#[from] sqlx::Error),
}

/// Logs the failure and returns the refusal for the client.
impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        tracing::error!(%error, "the database failed");
        Refusal::new(Code::Internal, "the database does not answer").retry_after(5.0)
    }
}
