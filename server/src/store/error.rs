//! Why the store did not do what it was asked.

use palmares_protocol::{Code, Refusal};
use std::path::PathBuf;

/// Why the store did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StoreError {
    /// The URL names a database this version cannot use.
    #[error(
        "database URL `{url}`: {why}; use sqlite:///path/to/palmares.sqlite or postgres://user@host/database"
    )]
    Url {
        /// As given, without what follows the scheme: it may hold a password.
        url: String,
        /// What is wrong with it.
        why: String,
    },
    /// Another server uses the database.
    #[error(
        "the database {place} is in use by another server; choose another with --data-dir or --database-url"
    )]
    Taken {
        /// Which.
        place: String,
    },
    /// The data directory cannot be made or written.
    #[error("cannot write in the data directory {}: {source}; choose another with --data-dir", path.display())]
    Folder {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The database cannot be opened.
    #[error("cannot open the database {place}: {source}")]
    Open {
        /// Which.
        place: String,
        /// What the database said.
        source: sqlx::Error,
    },
    /// The schema could not be brought up to date.
    #[error("cannot bring the database up to date: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A query failed.
    #[error("database: {0}")]
    Query(#[from] sqlx::Error),
}

/// Logs the failure and words it for whoever asked.
impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        tracing::error!(%error, "store failed");
        Refusal::new(Code::Internal, "the database does not answer").retry_after(5.0)
    }
}
