//! Where the database is, and how one server keeps others away from it.

use super::error::StoreError;
use sqlx::any::AnyConnectOptions;
use sqlx::{AnyConnection, Connection};
use std::fmt::Write;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Key of the advisory lock by which a server holds a Postgres database: "palmares" as a number.
const ADVISORY_KEY: i64 = i64::from_be_bytes(*b"palmares");

/// How long the database is waited for while another holds it: what a killed server held is given back by the system
/// and by Postgres only a moment after it, and its successor may be started in that moment.
const PATIENCE: Duration = Duration::from_secs(3);

/// Time between two attempts.
const BETWEEN_ATTEMPTS: Duration = Duration::from_millis(50);

/// Where the database is.
#[derive(Clone, Debug)]
pub(crate) enum Location {
    /// A file in the data directory, created when it is missing.
    DataDir(PathBuf),
    /// A URL.
    Url(String),
}

impl Location {
    /// The database of that URL, or without one that of the data directory.
    pub(crate) fn new(data_dir: &Path, database_url: Option<String>) -> Self {
        database_url.map_or_else(|| Location::DataDir(data_dir.to_owned()), Location::Url)
    }
}

/// Which dialect of SQL the database speaks, where it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    /// A file.
    Sqlite,
    /// A server.
    Postgres,
}

impl Dialect {
    /// How a transaction begins that will write: SQLite takes its one write lock at once, so that it waits for it
    /// instead of failing half-way.
    pub(super) fn begin(self) -> &'static str {
        match self {
            Dialect::Sqlite => "BEGIN IMMEDIATE",
            Dialect::Postgres => "BEGIN",
        }
    }

    /// How a transaction begins that reads everything as it is at one moment.
    pub(super) fn begin_snapshot(self) -> &'static str {
        match self {
            Dialect::Sqlite => "BEGIN DEFERRED",
            Dialect::Postgres => "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY",
        }
    }
}

/// A location made ready for a connection.
pub(super) struct Target {
    /// For messages; without a password.
    pub(super) place: String,
    pub(super) url: String,
    pub(super) dialect: Dialect,
    /// The file beside which the lock lies; none for a server.
    file: Option<PathBuf>,
}

/// Keeps other servers away from the database. The system or the database gives it back when the process ends,
/// however it ends.
#[derive(Debug)]
pub(super) enum Lock {
    File(File),
    /// A connection that holds an advisory lock as long as it lives.
    Advisory(Box<AnyConnection>),
}

impl Target {
    /// Reads a location. A data directory is created.
    pub(super) fn new(location: &Location) -> Result<Self, StoreError> {
        match location {
            Location::DataDir(folder) => {
                let failed = |source| StoreError::Folder { path: folder.clone(), source };
                std::fs::create_dir_all(folder).map_err(failed)?;
                let file = folder.canonicalize().map_err(failed)?.join("palmares.sqlite");
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
                    return Err(refused("a database in memory would not outlive the server".into()));
                }
                let url = match parameters.contains("mode=") {
                    true => url.to_owned(),
                    false if parameters.is_empty() => format!("{}?mode=rwc", url.trim_end_matches('?')),
                    false => format!("{url}&mode=rwc"),
                };
                // The lock lies beside the file; escapes in the path only give it another name.
                let file = Some(PathBuf::from(path));
                Ok(Target { place, url, dialect: Dialect::Sqlite, file })
            }
            _ => Err(refused("no database this program knows".into())),
        }
    }

    pub(super) fn options(&self) -> Result<AnyConnectOptions, StoreError> {
        AnyConnectOptions::from_str(&self.url)
            .map_err(|error| StoreError::Url { url: self.place.clone(), why: error.to_string() })
    }

    /// Takes the database for this process.
    ///
    /// # Errors
    /// [`StoreError::Taken`] when another process still has it after [`PATIENCE`].
    pub(super) async fn lock(&self) -> Result<Lock, StoreError> {
        let mut lock = self.unlocked().await?;
        let began = Instant::now();
        while !self.take(&mut lock).await? {
            if began.elapsed() >= PATIENCE {
                return Err(StoreError::Taken { place: self.place.clone() });
            }
            tokio::time::sleep(BETWEEN_ATTEMPTS).await;
        }
        Ok(lock)
    }

    /// What the lock is held with, before it is.
    async fn unlocked(&self) -> Result<Lock, StoreError> {
        use sqlx::ConnectOptions;
        match &self.file {
            Some(file) => {
                let path = file.with_file_name("palmares.lock");
                match File::options().create(true).append(true).open(&path) {
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

    /// Whether the lock could be taken.
    async fn take(&self, lock: &mut Lock) -> Result<bool, StoreError> {
        match lock {
            Lock::File(file) => match file.try_lock() {
                Ok(()) => Ok(true),
                Err(TryLockError::WouldBlock) => Ok(false),
                Err(TryLockError::Error(source)) => Err(self.unusable(source.into())),
            },
            Lock::Advisory(connection) => {
                let asked = sqlx::query_as("SELECT pg_try_advisory_lock($1)").bind(ADVISORY_KEY);
                let (taken,) =
                    asked.fetch_one(&mut **connection).await.map_err(|source| self.unusable(source))?;
                Ok(taken)
            }
        }
    }

    fn unusable(&self, source: sqlx::Error) -> StoreError {
        StoreError::Open { place: self.place.clone(), source }
    }
}

impl Lock {
    /// Gives the database back. The end of the process would do it too.
    pub(super) async fn release(self) {
        match self {
            Lock::File(file) => drop(file.unlock()),
            Lock::Advisory(mut connection) => {
                // Closing alone would do, but Postgres notices it only some time later.
                let unlock = sqlx::query("SELECT pg_advisory_unlock($1)").bind(ADVISORY_KEY);
                drop(unlock.execute(&mut *connection).await);
                drop(connection.close().await);
            }
        }
    }
}

/// A path for a URL: what is no letter, digit, slash or harmless mark is escaped.
fn percent_encoded(path: &Path) -> String {
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
