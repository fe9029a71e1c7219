//! The location of the database, and the lock that one server holds on it.

use super::error::StoreError;
use crate::files::private_files;
use sqlx::any::AnyConnectOptions;
use sqlx::{AnyConnection, Connection};
use std::fmt::Write;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Key of the advisory lock on a Postgres database: "palmares" as a number.
const ADVISORY_KEY: i64 = i64::from_be_bytes(*b"palmares");

/// Longest wait for the lock: after a server was killed, the system and Postgres release its lock with a delay, and its successor may
/// start in between.
const LOCK_TIMEOUT: Duration = Duration::from_secs(3);

/// Time between two attempts.
const RETRY_PERIOD: Duration = Duration::from_millis(50);

/// The location of the database.
#[derive(Clone, Debug)]
pub enum Location {
    /// A file in the data directory, created if it is missing.
    DataDir(PathBuf),
    /// A URL.
    Url(String),
}

impl Location {
    /// The database of a URL, or without one the file in the data directory.
    pub fn new(data_dir: &Path, database_url: Option<String>) -> Self {
        database_url.map_or_else(|| Location::DataDir(data_dir.to_owned()), Location::Url)
    }
}

/// The kind of database, where the SQL differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    /// A file.
    Sqlite,
    /// A server.
    Postgres,
}

impl Dialect {
    /// Begins a transaction that writes. SQLite takes its write lock at once: it waits there instead of failing later.
    pub(super) fn begin(self) -> &'static str {
        match self {
            Dialect::Sqlite => "BEGIN IMMEDIATE",
            Dialect::Postgres => "BEGIN",
        }
    }

    /// The database's clock as an expression, ms since 1970 UTC.
    pub(super) fn now_ms(self) -> &'static str {
        match self {
            Dialect::Sqlite => "CAST(unixepoch('subsec') * 1000 AS INTEGER)",
            Dialect::Postgres => "CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT)",
        }
    }

    /// Locks the selected rows of a table, and skips those that another transaction has locked. SQLite locks at the transaction's
    /// begin.
    pub(super) fn lock_rows_of(self, table: &str) -> String {
        match self {
            Dialect::Sqlite => String::new(),
            Dialect::Postgres => format!(" FOR UPDATE OF {table} SKIP LOCKED"),
        }
    }

    /// Begins a transaction that reads from one snapshot.
    pub(super) fn begin_snapshot(self) -> &'static str {
        match self {
            Dialect::Sqlite => "BEGIN DEFERRED",
            Dialect::Postgres => "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY",
        }
    }
}

/// A location, prepared for a connection.
pub(super) struct Target {
    /// For messages; without a password.
    pub(super) place: String,
    url: String,
    pub(super) dialect: Dialect,
    /// The database file, with the lock file in its folder; None for Postgres.
    file: Option<PathBuf>,
}

impl std::fmt::Debug for Target {
    /// Without the URL, which may contain a password.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Target({})", self.place)
    }
}

/// The lock on the database: on SQLite as long as the server runs, on Postgres until it has entered its hosts. It is released when the
/// process ends in any way.
#[derive(Debug)]
pub(super) enum Lock {
    File(File),
    /// A connection that holds an advisory lock until it closes.
    Advisory(Box<AnyConnection>),
}

impl Target {
    /// Prepares a location. Creates the data directory.
    pub(super) fn new(location: &Location) -> Result<Self, StoreError> {
        match location {
            Location::DataDir(folder) => {
                let failed = |source| StoreError::Folder { path: folder.clone(), source };
                private_files::make_folder(folder).map_err(failed)?;
                let file = folder.canonicalize().map_err(failed)?.join("palmares.sqlite");
                // SQLite gives the files beside it the same mode.
                private_files::open_or_make(&file).map_err(failed)?;
                let place = folder.join("palmares.sqlite").display().to_string();
                let url = format!("sqlite://{}?mode=rwc", percent_encoded(&file));
                Ok(Target { place, url, dialect: Dialect::Sqlite, file: Some(file) })
            }
            Location::Url(url) => Self::of_url(url),
        }
    }

    fn of_url(url: &str) -> Result<Self, StoreError> {
        let scheme = url.split_once(':').map(|(scheme, _)| scheme);
        let place = scheme.map_or("without a scheme".to_owned(), |scheme| format!("{scheme}:…"));
        let refused = |why: String| StoreError::Url { url: place.clone(), why };
        match scheme {
            Some("postgres" | "postgresql") => {
                Ok(Target { place, url: url.to_owned(), dialect: Dialect::Postgres, file: None })
            }
            Some("sqlite") => {
                let path = url.trim_start_matches("sqlite:").trim_start_matches("//");
                let (path, parameters) = path.split_once('?').unwrap_or((path, ""));
                if path.is_empty() || path.contains(":memory:") || parameters.contains("mode=memory") {
                    return Err(refused("a database in memory is lost when the server stops".into()));
                }
                let url = match parameters.contains("mode=") {
                    true => url.to_owned(),
                    false if parameters.is_empty() => format!("{}?mode=rwc", url.trim_end_matches('?')),
                    false => format!("{url}&mode=rwc"),
                };
                let file = PathBuf::from(path);
                // A path with escapes is another file's; the database then gets the mode that the system sets.
                if !parameters.contains("mode=") && !path.contains('%') {
                    let failed = |source| StoreError::Folder { path: file.clone(), source };
                    private_files::open_or_make(&file).map_err(failed)?;
                }
                // For the lock file only: escapes in the path change nothing but its name.
                let file = Some(file);
                Ok(Target { place, url, dialect: Dialect::Sqlite, file })
            }
            _ => Err(refused("this kind of database is not supported".into())),
        }
    }

    pub(super) fn options(&self) -> Result<AnyConnectOptions, StoreError> {
        AnyConnectOptions::from_str(&self.url)
            .map_err(|error| StoreError::Url { url: self.place.clone(), why: error.to_string() })
    }

    /// Takes the lock.
    ///
    /// # Errors
    /// [`StoreError::Taken`] if another process still has it after [`LOCK_TIMEOUT`].
    pub(super) async fn lock(&self) -> Result<Lock, StoreError> {
        let mut lock = self.unlocked().await?;
        let began = Instant::now();
        while !self.take(&mut lock).await? {
            if began.elapsed() >= LOCK_TIMEOUT {
                return Err(StoreError::Taken { place: self.place.clone() });
            }
            tokio::time::sleep(RETRY_PERIOD).await;
        }
        Ok(lock)
    }

    /// Opens the file or connection of the lock.
    async fn unlocked(&self) -> Result<Lock, StoreError> {
        use sqlx::ConnectOptions;
        match &self.file {
            Some(file) => {
                let path = file.with_file_name("palmares.lock");
                match private_files::open_or_make(&path) {
                    Ok(file) => Ok(Lock::File(file)),
                    Err(source) => Err(StoreError::Folder { path, source }),
                }
            }
            None => {
                let connection = self.options()?.connect().await.map_err(|source| self.unusable(source))?;
                Ok(Lock::Advisory(Box::new(connection)))
            }
        }
    }

    /// Tries to take the lock.
    async fn take(&self, lock: &mut Lock) -> Result<bool, StoreError> {
        match lock {
            Lock::File(file) => match file.try_lock() {
                Ok(()) => Ok(true),
                Err(TryLockError::WouldBlock) => Ok(false),
                Err(TryLockError::Error(source)) => Err(self.unusable(source.into())),
            },
            Lock::Advisory(connection) => {
                let query = sqlx::query_as("SELECT pg_try_advisory_lock($1)").bind(ADVISORY_KEY);
                let (taken,) =
                    query.fetch_one(&mut **connection).await.map_err(|source| self.unusable(source))?;
                Ok(taken)
            }
        }
    }

    fn unusable(&self, source: sqlx::Error) -> StoreError {
        StoreError::Open { place: self.place.clone(), source }
    }
}

impl Lock {
    /// Releases the lock.
    pub(super) async fn release(self) {
        match self {
            Lock::File(file) => drop(file.unlock()),
            Lock::Advisory(mut connection) => {
                // Postgres notices a closed connection only after a while.
                let unlock = sqlx::query("SELECT pg_advisory_unlock($1)").bind(ADVISORY_KEY);
                drop(unlock.execute(&mut *connection).await);
                drop(connection.close().await);
            }
        }
    }
}

/// A path for a URL: all bytes but letters, digits and `/-._~` are escaped.
pub(super) fn percent_encoded(path: &Path) -> String {
    let mut text = String::new();
    for &byte in path.as_os_str().as_encoded_bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte) {
            text.push(char::from(byte));
        } else {
            // Writing into a string cannot fail.
            let _ = write!(text, "%{byte:02X}");
        }
    }
    text
}
