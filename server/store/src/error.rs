//! Failures of the database.

use palmares_protocol::{Code, Refusal};
use std::path::PathBuf;

/// A failure of the database.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
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
    /// Another host that runs cannot share the database with this one.
    #[error("the database {place} is in use by the host `{host}`{why}")]
    Host {
        /// The database.
        place: String,
        /// The other host.
        host: String,
        /// The reason, and what to do.
        why: String,
    },
    /// A host of the same name runs.
    #[error("the database {place} has a host `{host}` that runs; give each server a [fleet] host of its own")]
    SameHost {
        /// The database.
        place: String,
        /// The name.
        host: String,
    },
    /// The competition was opened with another engine.
    #[error(
        "the competition in {place} is open with the engine {opened_with}, this server has {engine}: scores of two engines cannot \
         be compared; start the version that it was opened with, or close the competition with it first"
    )]
    Engine {
        /// The database.
        place: String,
        /// The engine with which it was opened.
        opened_with: String,
        /// That of this server.
        engine: String,
    },
    /// A migration is needed while a server runs.
    #[error(
        "the database {place} must be brought up to date, but the host `{host}` of an older version uses it; stop it first"
    )]
    Older {
        /// The database.
        place: String,
        /// The other host.
        host: String,
    },
    /// The session has another owner.
    #[error("the session {session_id} belongs to another server now")]
    Stale {
        /// The session.
        session_id: String,
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
        if let StoreError::Stale { .. } = error {
            tracing::warn!(%error, "a write was refused");
            let message = "the session continues on another server; connect again";
            return Refusal::new(Code::Internal, message).retry_after(0.5);
        }
        tracing::error!(%error, "the database failed");
        Refusal::new(Code::Internal, "the database does not answer").retry_after(5.0)
    }
}
