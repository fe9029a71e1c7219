//! What outlives the process: sessions and runs.

mod leaderboard;
mod runs;
mod sessions;

pub(crate) use leaderboard::LeaderboardRow;
#[cfg(test)]
pub(crate) use leaderboard::TaskBest;
pub(crate) use runs::{FinishedRun, NewRun, RunRecord};
pub(crate) use sessions::NewSession;

use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{SqlSafeStr, SqlitePool};
use std::borrow::Cow;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Version, name, statements. Embedded, so that the program needs no files beside it.
const MIGRATIONS: [(i64, &str, &str); 1] =
    [(1, "sessions and runs", include_str!("../../migrations/0001_sessions_and_runs.sql"))];

/// Why the store did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StoreError {
    /// The URL names a database this version cannot use.
    #[error("database URL `{url}`: {why}; use sqlite:///path/to/palmares.sqlite")]
    Url {
        /// As given, without what follows the scheme: it may hold a password.
        url: String,
        /// What is wrong with it.
        why: String,
    },
    /// Another server uses the data directory.
    #[error("the data directory {} is in use by another server; choose another with --data-dir", path.display())]
    Taken {
        /// Which.
        path: PathBuf,
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

/// Where the database is.
#[derive(Clone, Debug)]
pub(crate) enum Location {
    /// A file in the data directory, created when it is missing.
    DataDir(PathBuf),
    /// A URL.
    Url(String),
}

/// The database.
#[derive(Clone, Debug)]
pub(crate) struct Store {
    pool: SqlitePool,
    lock: Option<Arc<File>>,
}

impl Store {
    /// Opens the database, creating and upgrading it as needed.
    ///
    /// # Errors
    /// When the place cannot be written, is no database, or was written by a newer version.
    pub(crate) async fn open(location: &Location) -> Result<Self, StoreError> {
        let (place, options, lock) = match location {
            Location::DataDir(folder) => {
                std::fs::create_dir_all(folder)
                    .map_err(|source| StoreError::Folder { path: folder.clone(), source })?;
                let file = folder.join("palmares.sqlite");
                let lock = Arc::new(lock(folder)?);
                (file.display().to_string(), SqliteConnectOptions::new().filename(file), Some(lock))
            }
            Location::Url(url) => (scheme_of(url), parse_url(url)?, None),
        };
        // WAL: readers never wait for the writer. FULL: a commit is on the disk before the client hears its
        // score, also when the power fails; with two small commits per run the price is not felt.
        let options = options
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(Duration::from_secs(5))
            .foreign_keys(true);
        let pool = SqlitePoolOptions::new()
            .max_connections(4)
            .acquire_timeout(Duration::from_secs(10))
            .connect_with(options)
            .await
            .map_err(|source| StoreError::Open { place, source })?;
        migrator().run(&pool).await?;
        Ok(Store { pool, lock })
    }

    /// Whether the database answers.
    pub(crate) async fn ping(&self) -> Result<(), StoreError> {
        sqlx::query("SELECT COUNT(*) FROM sessions WHERE session_id = ''").fetch_one(&self.pool).await?;
        Ok(())
    }

    /// Closes all connections; the write-ahead log is merged into the file. The directory is free again.
    pub(crate) async fn close(&self) {
        self.pool.close().await;
        if let Some(lock) = &self.lock {
            // The end of the process unlocks it in any case.
            let _ = lock.unlock();
        }
    }
}

fn scheme_of(url: &str) -> String {
    match url.split_once(':') {
        Some((scheme, _)) => format!("{scheme}:…"),
        None => "without a scheme".into(),
    }
}

fn parse_url(url: &str) -> Result<SqliteConnectOptions, StoreError> {
    if !url.starts_with("sqlite:") {
        let why = "this version stores in SQLite only".to_owned();
        return Err(StoreError::Url { url: scheme_of(url), why });
    }
    SqliteConnectOptions::from_str(url)
        .map_err(|error| StoreError::Url { url: scheme_of(url), why: error.to_string() })
}

fn migrator() -> Migrator {
    let migrations = MIGRATIONS.map(|(version, name, sql)| {
        Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql.into_sql_str(), false)
    });
    Migrator::with_migrations(migrations.into())
}

/// Takes the data directory for this process. The system gives it back when the process ends, however it ends.
fn lock(folder: &Path) -> Result<File, StoreError> {
    let path = folder.join("palmares.lock");
    let file = File::options().create(true).append(true).open(&path);
    let file = file.map_err(|source| StoreError::Folder { path: folder.to_owned(), source })?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::Taken { path: folder.to_owned() }),
        Err(TryLockError::Error(source)) => Err(StoreError::Folder { path: folder.to_owned(), source }),
    }
}

/// Now, in ms since 1970 UTC.
pub(crate) fn unix_ms() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests;
