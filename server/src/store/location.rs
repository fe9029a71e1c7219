//! Where the database is, and how one server keeps others away from it.

use super::StoreError;
use sqlx::any::AnyConnectOptions;
use sqlx::{AnyConnection, Connection};
use std::fmt::Write;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Key of the advisory lock by which a server holds a Postgres database: "palmares" as a number.
const ADVISORY_KEY: i64 = i64::from_be_bytes(*b"palmares");

/// Where the database is.
#[derive(Clone, Debug)]
pub(crate) enum Location {
    /// A file in the data directory, created when it is missing.
    DataDir(PathBuf),
    /// A URL.
    Url(String),
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
    pub(super) async fn lock(&self) -> Result<Lock, StoreError> {
        match &self.file {
            Some(file) => Ok(Lock::File(lock_file(&file.with_file_name("palmares.lock"), &self.place)?)),
            None => self.lock_server().await,
        }
    }

    async fn lock_server(&self) -> Result<Lock, StoreError> {
        use sqlx::ConnectOptions;
        let failed = |source| StoreError::Open { place: self.place.clone(), source };
        let mut connection = self.options()?.connect().await.map_err(failed)?;
        let (taken,): (bool,) = sqlx::query_as("SELECT pg_try_advisory_lock($1)")
            .bind(ADVISORY_KEY)
            .fetch_one(&mut connection)
            .await
            .map_err(failed)?;
        if taken {
            Ok(Lock::Advisory(Box::new(connection)))
        } else {
            Err(StoreError::Taken { place: self.place.clone() })
        }
    }
}

impl Lock {
    pub(super) async fn release(self) {
        // The end of the process unlocks in any case.
        match self {
            Lock::File(file) => drop(file.unlock()),
            Lock::Advisory(connection) => drop(connection.close().await),
        }
    }
}

fn lock_file(path: &Path, place: &str) -> Result<File, StoreError> {
    let failed = |source| StoreError::Folder { path: path.to_owned(), source };
    let file = File::options().create(true).append(true).open(path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::Taken { place: place.to_owned() }),
        Err(TryLockError::Error(source)) => Err(failed(source)),
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
