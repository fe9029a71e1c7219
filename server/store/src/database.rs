//! The database: opened, migrated, and this server's place in it.

use super::error::StoreError;
use super::host::{Host, HostKey};
use super::location::{Dialect, Location, Lock, Target};
use super::transaction::Transaction;
use parking_lot::RwLock;
use sqlx::any::{AnyPoolOptions, install_default_drivers};
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{AnyConnection, AnyPool, AssertSqlSafe, Executor, SqlSafeStr};
use std::borrow::Cow;
use std::io::ErrorKind;
use std::num::NonZero;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Mutex, watch};

/// Version, name and text of each migration, embedded in the program. [`text_for`] says how the text is written.
const MIGRATIONS: [(i64, &str, &str); 16] = [
    (1, "sessions and runs", include_str!("../migrations/0001_sessions_and_runs.sql")),
    (2, "competition", include_str!("../migrations/0002_competition.sql")),
    (3, "time given back", include_str!("../migrations/0003_time_given_back.sql")),
    (4, "likeness of runs", include_str!("../migrations/0004_likeness.sql")),
    (5, "announcements", include_str!("../migrations/0005_announcements.sql")),
    (6, "fleet", include_str!("../migrations/0006_fleet.sql")),
    (7, "lists of organizers", include_str!("../migrations/0007_organizers.sql")),
    (8, "ranking", include_str!("../migrations/0008_ranking.sql")),
    (9, "verification", include_str!("../migrations/0009_verification.sql")),
    (10, "schedule", include_str!("../migrations/0010_schedule.sql")),
    (11, "objects", include_str!("../migrations/0011_objects.sql")),
    (12, "queues of hosts", include_str!("../migrations/0012_queues.sql")),
    (13, "proofs of writing", include_str!("../migrations/0013_proofs.sql")),
    (14, "order of ends", include_str!("../migrations/0014_order_of_ends.sql")),
    (15, "undo", include_str!("../migrations/0015_undo.sql")),
    (16, "likeness of paths", include_str!("../migrations/0016_likeness_of_paths.sql")),
];

/// Connections to a SQLite file.
const SQLITE_CONNECTIONS: u32 = 4;

/// For every connection to SQLite. WAL: readers never wait for the writer. FULL: a commit is on the disk before the client gets its
/// score, even if the power fails; with two small commits per run this costs little.
const SQLITE_SETUP: &str = "PRAGMA busy_timeout = 5000; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON";

/// For every connection to Postgres: a server that is stopped in the middle of a transaction must not hold its locks.
const POSTGRES_SETUP: &str = "SET idle_in_transaction_session_timeout = '1s'; SET lock_timeout = '1500ms'; \
     SET statement_timeout = '5s'";

/// The database.
#[derive(Clone, Debug)]
pub struct Store {
    pool: Arc<RwLock<AnyPool>>,
    /// Counts how often the connections were replaced.
    replaced: Arc<watch::Sender<u64>>,
    pub(super) dialect: Dialect,
    target: Arc<Target>,
    lock: Arc<Mutex<Option<Lock>>>,
    /// This process, as an owner of sessions.
    pub(super) host: Arc<HostKey>,
    /// Held while an audit record gets its number.
    pub(super) audit: Arc<Mutex<()>>,
}

impl Store {
    /// Opens the database; creates and migrates it as needed, and enters this server as a host.
    ///
    /// # Errors
    /// The database cannot be opened or written, is in use by a server beside which this one cannot run, or was written by a newer
    /// version.
    pub async fn open(location: &Location, host: &Host) -> Result<Self, StoreError> {
        install_default_drivers();
        let target = Target::new(location)?;
        // While it is held nobody else migrates or enters. A server of a version before hosts holds it as long as it runs.
        let lock = target.lock().await?;
        let pool = connect(&target).await?;
        if target.dialect == Dialect::Postgres {
            refuse_beside_older(&pool, &target.place).await?;
        }
        migrate(&pool, target.dialect).await?;
        let store = Store {
            dialect: target.dialect,
            pool: Arc::new(RwLock::new(pool)),
            replaced: Arc::default(),
            lock: Arc::default(),
            host: Arc::new(HostKey::new(host)?),
            target: Arc::new(target),
            audit: Arc::default(),
        };
        match store.dialect {
            Dialect::Sqlite => *store.lock.lock().await = Some(lock),
            Dialect::Postgres => {
                // The host's row keeps others away from now on: a lock is lost with its connection.
                let entered = store.enter(host, &store.target.place).await;
                lock.release().await;
                entered?;
            }
        }
        Ok(store)
    }

    /// The connections. They are replaced after an outage.
    pub(super) fn pool(&self) -> AnyPool {
        self.pool.read().clone()
    }

    /// Replaces all connections: those that were open when a network failed can hang for minutes after its repair.
    ///
    /// # Errors
    /// The database cannot be opened.
    pub async fn reconnect(&self) -> Result<(), StoreError> {
        let pool = connect(&self.target).await?;
        let old = std::mem::replace(&mut *self.pool.write(), pool);
        self.replaced.send_modify(|count| *count += 1);
        // Waits for connections in use, which may be those that hang.
        tokio::spawn(async move { old.close().await });
        Ok(())
    }

    /// The result of a statement; an error if the connections are replaced before it is there: then the statement's connection may hang
    /// until TCP gives it up. Whether it was carried out is not known.
    pub async fn answered<T, E: From<StoreError>>(
        &self,
        statement: impl Future<Output = Result<T, E>>,
    ) -> Result<T, E> {
        let mut replaced = self.replaced.subscribe();
        tokio::select! {
            biased;
            done = statement => done,
            // The sender is in `self`: waiting cannot fail.
            _ = replaced.changed() => Err(StoreError::from(sqlx::Error::Io(ErrorKind::TimedOut.into())).into()),
        }
    }

    /// A connection of its own, outside the pool.
    pub async fn connection(&self) -> Result<AnyConnection, StoreError> {
        use sqlx::ConnectOptions;
        let mut connection = self.target.options()?.connect().await?;
        connection.execute(setup(self.dialect)).await?;
        Ok(connection)
    }

    /// Whether several servers can share this database.
    pub fn is_shared(&self) -> bool {
        self.dialect == Dialect::Postgres
    }

    /// Leaves: releases the lock, or gives up the lease. Closes all connections; SQLite merges its write-ahead log into the file.
    pub async fn close(&self) {
        if let Err(error) = self.leave().await {
            tracing::warn!(%error, "the server's lease ends by itself");
        }
        self.pool().close().await;
        if let Some(lock) = self.lock.lock().await.take() {
            lock.release().await;
        }
    }

    /// A transaction that reads from one snapshot.
    pub(super) async fn snapshot(&self) -> Result<Transaction, StoreError> {
        Ok(Transaction::begin(&self.pool(), self.dialect.begin_snapshot()).await?)
    }

    /// A transaction that will write.
    pub(super) async fn write(&self) -> Result<Transaction, StoreError> {
        Ok(Transaction::begin(&self.pool(), self.dialect.begin()).await?)
    }
}

fn setup(dialect: Dialect) -> &'static str {
    match dialect {
        Dialect::Sqlite => SQLITE_SETUP,
        Dialect::Postgres => POSTGRES_SETUP,
    }
}

/// A pool of connections.
async fn connect(target: &Target) -> Result<AnyPool, StoreError> {
    let dialect = target.dialect;
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get) as u32;
    let (connections, patience_s) = match dialect {
        Dialect::Sqlite => (SQLITE_CONNECTIONS, 10),
        Dialect::Postgres => (SQLITE_CONNECTIONS + cores, 3),
    };
    let pool = AnyPoolOptions::new()
        .max_connections(connections)
        .acquire_timeout(Duration::from_secs(patience_s))
        .after_connect(move |connection, _| {
            Box::pin(async move { connection.execute(setup(dialect)).await.map(|_| ()) })
        })
        .connect_with(target.options()?)
        .await;
    pool.map_err(|source| StoreError::Open { place: target.place.clone(), source })
}

/// Refuses to migrate a database on which servers of another version run.
async fn refuse_beside_older(pool: &AnyPool, place: &str) -> Result<(), StoreError> {
    let known: Option<i64> = sqlx::query_scalar(
        "SELECT COUNT(*) FROM pg_tables WHERE tablename IN ('hosts', '_sqlx_migrations') \
         AND schemaname = ANY (current_schemas(false))",
    )
    .fetch_optional(pool)
    .await?;
    if known != Some(2) {
        return Ok(());
    }
    let version: Option<i64> =
        sqlx::query_scalar("SELECT MAX(version) FROM _sqlx_migrations").fetch_one(pool).await?;
    if version.is_none_or(|version| version >= MIGRATIONS[MIGRATIONS.len() - 1].0) {
        return Ok(());
    }
    let alive = super::host::alive(&mut *pool.acquire().await?, Dialect::Postgres).await?;
    match alive.first() {
        Some(host) => Err(StoreError::Older { place: place.to_owned(), host: host.host_id.clone() }),
        None => Ok(()),
    }
}

/// Brings the database up to date.
async fn migrate(pool: &AnyPool, dialect: Dialect) -> Result<(), StoreError> {
    let mut connection = pool.acquire().await?;
    if dialect == Dialect::Sqlite {
        // A new file needs no flush for each migration: after a crash of the machine it lacks the last ones, which are repeated. The
        // next commit flushes them all.
        connection.execute("PRAGMA synchronous = NORMAL").await?;
    }
    migrator(dialect).run(&mut *connection).await?;
    if dialect == Dialect::Sqlite {
        connection.execute("PRAGMA synchronous = FULL").await?;
    }
    Ok(())
}

pub(super) fn migrator(dialect: Dialect) -> Migrator {
    let migrations = MIGRATIONS.map(|(version, name, text)| {
        let sql = AssertSqlSafe(text_for(dialect, text)).into_sql_str();
        Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql, false)
    });
    Migrator::with_migrations(migrations.into())
}

/// The lines of a migration for one dialect. A line `-- SQLite:` or `-- Postgres:` begins lines for this dialect only, a line
/// `-- Both:` ends them.
fn text_for(dialect: Dialect, text: &str) -> String {
    let mut only = None;
    let mut kept = String::new();
    for line in text.split_inclusive('\n') {
        match line.trim_end() {
            "-- SQLite:" => only = Some(Dialect::Sqlite),
            "-- Postgres:" => only = Some(Dialect::Postgres),
            "-- Both:" => only = None,
            _ if only.is_none_or(|only| only == dialect) => kept += line,
            _ => {}
        }
    }
    kept
}
