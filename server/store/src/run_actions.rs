//! The ticks of open runs, from which another host continues them, and of ended runs, until their replays are in safety: tables `run_actions` and `run_snapshots`, on Postgres only.
//!
//! Only the owner of a session writes its runs' ticks. Each statement locks the rows of the sessions while it checks their epochs. A
//! condition without the lock is not enough: a new owner may commit between the check and the write.

use super::database::Store;
use super::error::StoreError;
use super::host::Held;
use super::number::signed;
use sqlx::{AnyConnection, AssertSqlSafe, Executor};
use std::collections::BTreeSet;
use std::time::Duration;

/// Longest time for a statement, and for the connection.
const TIMEOUT: Duration = Duration::from_secs(2);
/// The same for the server: a statement that was given up holds no lock for long.
const SETUP: &str = "SET statement_timeout = '2s'";
/// Largest number of rows in a statement. It has six parameters a row, of at most 65,535.
const MAX_ROWS: usize = 1_000;

/// A run of a session that this process owns.
#[derive(Clone, Debug)]
pub struct OwnedRun {
    /// The run.
    pub run_id: String,
    /// Its session.
    pub held: Held,
}

/// Consecutive ticks of a run.
#[derive(Clone, Debug)]
pub struct SentTicks {
    /// The run.
    pub run: OwnedRun,
    /// The tick before the first of them.
    pub from_tick: u64,
    /// Their number.
    pub ticks: u64,
    /// Their encoding.
    pub body: Vec<u8>,
}

/// A snapshot of a run.
#[derive(Clone, Debug)]
pub struct SentSnapshot {
    /// The run.
    pub run: OwnedRun,
    /// The tick after which it was taken.
    pub tick: u64,
    /// Its bytes.
    pub body: Vec<u8>,
}

/// Consecutive ticks of a run, as stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredTicks {
    /// The tick before the first of them.
    pub from_tick: i64,
    /// Their number.
    pub ticks: i64,
    /// Their encoding.
    pub body: Vec<u8>,
}

from_row!(StoredTicks { from_tick, ticks, body });

/// What another host needs to continue a run, in addition to its header.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ShippedRun {
    /// All ticks, in order.
    pub ticks: Vec<StoredTicks>,
    /// The last snapshot. It can be missing: the table is a cache.
    pub snapshot: Option<Vec<u8>>,
}

/// A connection of its own for the ticks of all runs.
pub struct ShippingConnection(AnyConnection);

/// `($1::text, …), …` for rows of these types.
fn values(types: &[&str], rows: usize) -> String {
    let row = |row: usize| {
        let value = |(k, kind)| format!("${}::{kind}", row * types.len() + k + 1);
        format!("({})", types.iter().enumerate().map(value).collect::<Vec<_>>().join(", "))
    };
    (0..rows).map(row).collect::<Vec<_>>().join(", ")
}

/// Rows of the sent runs whose session has the same owner, locked until the statement ends.
fn held(columns: &str, types: &[&str], rows: usize) -> String {
    format!(
        "WITH sent (run_id, session_id, epoch, {columns}) AS (VALUES {}), held AS (SELECT sent.* FROM sent \
         JOIN sessions ON sessions.session_id = sent.session_id AND sessions.epoch = sent.epoch \
         FOR SHARE OF sessions)",
        values(types, rows)
    )
}

impl ShippingConnection {
    /// Stores ticks. Returns the runs that are still this owner's.
    pub async fn store_ticks(&mut self, sent: &[SentTicks]) -> Result<BTreeSet<String>, StoreError> {
        let mut stored = BTreeSet::new();
        for sent in sent.chunks(MAX_ROWS) {
            let types = ["text", "text", "bigint", "bigint", "bigint", "bytea"];
            let sql = format!(
                "{} INSERT INTO run_actions (run_id, from_tick, ticks, epoch, body) \
                 SELECT run_id, from_tick, ticks, epoch, body FROM held ON CONFLICT (run_id, from_tick) DO UPDATE \
                 SET ticks = EXCLUDED.ticks, epoch = EXCLUDED.epoch, body = EXCLUDED.body RETURNING run_id",
                held("from_tick, ticks, body", &types, sent.len())
            );
            let mut query = sqlx::query_scalar(AssertSqlSafe(sql));
            for SentTicks { run: OwnedRun { run_id, held }, from_tick, ticks, body } in sent {
                query = query.bind(run_id).bind(&held.session_id).bind(held.epoch);
                query = query.bind(signed(*from_tick)).bind(signed(*ticks)).bind(body);
            }
            let rows: Vec<String> = within(query.fetch_all(&mut self.0)).await?;
            stored.extend(rows);
        }
        Ok(stored)
    }

    /// Stores snapshots in place of earlier ones. Returns the runs that are still this owner's.
    pub async fn store_snapshots(&mut self, sent: &[SentSnapshot]) -> Result<BTreeSet<String>, StoreError> {
        let mut stored = BTreeSet::new();
        for sent in sent.chunks(MAX_ROWS) {
            let types = ["text", "text", "bigint", "bigint", "bytea"];
            let sql = format!(
                "{} INSERT INTO run_snapshots (run_id, tick, epoch, body) SELECT run_id, tick, epoch, body FROM held \
                 ON CONFLICT (run_id) DO UPDATE SET tick = EXCLUDED.tick, epoch = EXCLUDED.epoch, \
                 body = EXCLUDED.body RETURNING run_id",
                held("tick, body", &types, sent.len())
            );
            let mut query = sqlx::query_scalar(AssertSqlSafe(sql));
            for SentSnapshot { run: OwnedRun { run_id, held }, tick, body } in sent {
                query = query.bind(run_id).bind(&held.session_id).bind(held.epoch);
                query = query.bind(signed(*tick)).bind(body);
            }
            let rows: Vec<String> = within(query.fetch_all(&mut self.0)).await?;
            stored.extend(rows);
        }
        Ok(stored)
    }
}

/// The result, or an error after [`TIMEOUT`]: then the connection is not usable any more.
async fn within<T, E: Into<StoreError>>(work: impl Future<Output = Result<T, E>>) -> Result<T, StoreError> {
    match tokio::time::timeout(TIMEOUT, work).await {
        Ok(done) => done.map_err(Into::into),
        Err(_) => Err(sqlx::Error::Io(std::io::ErrorKind::TimedOut.into()).into()),
    }
}

impl Store {
    /// Opens the connection for the ticks of all runs.
    pub async fn shipping_connection(&self) -> Result<ShippingConnection, StoreError> {
        let open = async {
            let mut connection = self.connection().await?;
            connection.execute(SETUP).await?;
            Ok::<_, StoreError>(ShippingConnection(connection))
        };
        within(open).await
    }

    /// The ticks of a run, and its snapshot. The caller owns the session: no other host adds ticks.
    pub async fn shipped_run(&self, run_id: &str) -> Result<ShippedRun, StoreError> {
        let query = sqlx::query_as(
            "SELECT from_tick, ticks, body FROM run_actions WHERE run_id = $1 ORDER BY from_tick",
        );
        let ticks = query.bind(run_id).fetch_all(&self.pool()).await?;
        let query = sqlx::query_scalar("SELECT body FROM run_snapshots WHERE run_id = $1");
        let snapshot = query.bind(run_id).fetch_optional(&self.pool()).await?;
        Ok(ShippedRun { ticks, snapshot })
    }

    /// Deletes the snapshots of runs that have ended in any way, and the ticks that are not needed any more. They are needed until
    /// the replay is in the shared storage; without one (`shared` is false), until it was verified in a data directory.
    pub async fn sweep_shipped_runs(&self, shared: bool) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        let unsafe_replays = "OR runs.replay_sha256 IS NOT NULL AND runs.replay_stored_at IS NULL \
             AND (runs.status = 'provisional' OR $1 = 1 AND runs.status IN ('verified', 'rejected'))";
        for (table, kept) in [("run_actions", unsafe_replays), ("run_snapshots", "AND $1 IN (0, 1)")] {
            let sql = AssertSqlSafe(format!(
                "DELETE FROM {table} WHERE NOT EXISTS (SELECT 1 FROM runs WHERE runs.run_id = {table}.run_id \
                 AND (runs.status = 'open' {kept}))"
            ));
            sqlx::query(sql).bind(i64::from(shared)).execute(&mut *transaction).await?;
        }
        Ok(transaction.commit().await?)
    }

    /// Deletes the ticks and the snapshot of a run whose replay is stored.
    pub async fn delete_shipped_run(&self, run_id: &str) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        for table in ["run_actions", "run_snapshots"] {
            let sql = AssertSqlSafe(format!("DELETE FROM {table} WHERE run_id = $1"));
            sqlx::query(sql).bind(run_id).execute(&mut *transaction).await?;
        }
        Ok(transaction.commit().await?)
    }
}
