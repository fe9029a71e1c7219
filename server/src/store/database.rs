//! The database: opened, migrated, locked for one server.

use super::error::StoreError;
use super::location::{Dialect, Location, Lock, Target};
use Statements::{Each, Same};
use sqlx::any::{AnyPoolOptions, install_default_drivers};
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Any, AnyPool, Executor, SqlSafeStr, Transaction};
use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;

/// Version, name and statements, embedded in the program: the same for both dialects, or SQLite's and Postgres's.
const MIGRATIONS: [(i64, &str, Statements); 8] = [
    (1, "sessions and runs", Same(include_str!("../../migrations/0001_sessions_and_runs.sql"))),
    (2, "competition", Same(include_str!("../../migrations/0002_competition.sql"))),
    (3, "time given back", Same(include_str!("../../migrations/0003_time_given_back.sql"))),
    (4, "likeness of runs", Same(include_str!("../../migrations/0004_likeness.sql"))),
    (5, "announcements", Same(include_str!("../../migrations/0005_announcements.sql"))),
    (7, "similar runs", Same(include_str!("../../migrations/0007_similar_runs.sql"))),
    (
        8,
        "ranking",
        Each {
            sqlite: include_str!("../../migrations/0008_ranking.sqlite.sql"),
            postgres: include_str!("../../migrations/0008_ranking.postgres.sql"),
        },
    ),
    (9, "verification", Same(include_str!("../../migrations/0009_verification.sql"))),
];

/// The statements of a migration.
#[derive(Clone, Copy)]
enum Statements {
    Same(&'static str),
    Each { sqlite: &'static str, postgres: &'static str },
}

/// The database.
#[derive(Clone, Debug)]
pub(crate) struct Store {
    pub(super) pool: AnyPool,
    pub(super) dialect: Dialect,
    lock: Arc<Mutex<Option<Lock>>>,
    /// Held while an audit record gets its number.
    pub(super) audit: Arc<Mutex<()>>,
}

impl Store {
    /// Opens the database; creates and migrates it as needed.
    ///
    /// # Errors
    /// The database cannot be opened or written, is in use by another server, or was written by a newer version.
    pub(crate) async fn open(location: &Location) -> Result<Self, StoreError> {
        install_default_drivers();
        let target = Target::new(location)?;
        let lock = target.lock().await?;
        let dialect = target.dialect;
        let pool = AnyPoolOptions::new()
            .max_connections(4)
            .acquire_timeout(Duration::from_secs(10))
            .after_connect(move |connection, _| {
                Box::pin(async move {
                    // WAL: readers never wait for the writer. FULL: a commit is on the disk before the client gets
                    // its score, even if the power fails; with two small commits per run this costs little.
                    if dialect == Dialect::Sqlite {
                        connection
                            .execute(
                                "PRAGMA busy_timeout = 5000; PRAGMA journal_mode = WAL; \
                                 PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON",
                            )
                            .await?;
                    }
                    Ok(())
                })
            })
            .connect_with(target.options()?)
            .await
            .map_err(|source| StoreError::Open { place: target.place, source })?;
        migrator(dialect).run(&pool).await?;
        Ok(Store { pool, dialect, lock: Arc::new(Mutex::new(Some(lock))), audit: Arc::default() })
    }

    /// Whether the database answers.
    pub(crate) async fn ping(&self) -> Result<(), StoreError> {
        sqlx::query("SELECT COUNT(*) FROM sessions WHERE session_id = ''").fetch_one(&self.pool).await?;
        Ok(())
    }

    /// Closes all connections and releases the lock; SQLite merges its write-ahead log into the file.
    pub(crate) async fn close(&self) {
        self.pool.close().await;
        if let Some(lock) = self.lock.lock().await.take() {
            lock.release().await;
        }
    }

    /// A transaction that will write.
    pub(super) async fn write(&self) -> Result<Transaction<'static, Any>, StoreError> {
        Ok(self.pool.begin_with(self.dialect.begin()).await?)
    }
}

fn migrator(dialect: Dialect) -> Migrator {
    let migrations = MIGRATIONS.map(|(version, name, statements)| {
        let sql = match (statements, dialect) {
            (Same(sql), _) | (Each { sqlite: sql, .. }, Dialect::Sqlite) => sql,
            (Each { postgres: sql, .. }, Dialect::Postgres) => sql,
        };
        Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql.into_sql_str(), false)
    });
    Migrator::with_migrations(migrations.into())
}
