//! The audit: actions of organizers and the server, with time and reason. Records are only added.

use super::database::Store;
use super::error::StoreError;
use super::location::Dialect;
use super::number::{signed, unix_ms};
use super::transaction::Transaction;
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::Any;
use sqlx::any::AnyArguments;
use sqlx::query::Query;

/// A new record.
#[derive(Clone, Copy, Debug)]
pub struct NewAuditEntry<'a> {
    /// Id of the token that was used, or `server`.
    pub actor: &'a str,
    /// The action, such as `session.pause`.
    pub action: &'a str,
    /// Its object.
    pub subject: &'a str,
    /// The organizer's reason.
    pub reason: Option<&'a str>,
}

/// A record.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct AuditEntry {
    /// Counts up from 1.
    pub seq: i64,
    /// Time, ms since 1970 UTC.
    pub unix_ms: i64,
    /// Id of the token that was used, or `server`.
    pub actor: String,
    /// Label of this token: its holder.
    pub label: Option<String>,
    /// The action.
    pub action: String,
    /// Its object.
    pub subject: String,
    /// Granted time, s; for `session.grant`.
    pub seconds: Option<f64>,
    /// The reason.
    pub reason: Option<String>,
}

from_row!(AuditEntry { seq, unix_ms: "at", actor, label, action, subject, seconds, reason });

/// Key of the advisory lock on Postgres under which records get their numbers: "plmaudit" as a number.
const NUMBERING_KEY: i64 = i64::from_be_bytes(*b"plmaudit");

impl Store {
    /// A transaction that begins with a record of its action: both are stored or neither. There is one at a time, also of several
    /// servers on one database.
    pub(super) async fn recorded(&self, entry: &NewAuditEntry<'_>) -> Result<Recorded<'_>, StoreError> {
        // Of this process one transaction waits, so that the others leave it connections.
        let numbering = self.audit.lock().await;
        let mut transaction = self.write().await?;
        // SQLite has one writer anyway.
        if self.dialect == Dialect::Postgres {
            let lock = sqlx::query("SELECT pg_advisory_xact_lock($1)").bind(NUMBERING_KEY);
            lock.execute(&mut *transaction).await?;
        }
        sqlx::query(
            "INSERT INTO audit (seq, at, actor, action, subject, reason) \
             SELECT COALESCE(MAX(seq), 0) + 1, $1, $2, $3, $4, $5 FROM audit",
        )
        .bind(unix_ms())
        .bind(entry.actor)
        .bind(entry.action)
        .bind(entry.subject)
        .bind(entry.reason)
        .execute(&mut *transaction)
        .await?;
        Ok(Recorded { transaction, _numbering: numbering })
    }

    /// Writes a record of an action that changes nothing else in the database.
    pub async fn record(&self, entry: &NewAuditEntry<'_>) -> Result<(), StoreError> {
        self.recorded(entry).await?.commit().await
    }

    /// The records after number `after`, oldest first, at most `limit` of them.
    pub async fn audit(&self, after: u64, limit: u32) -> Result<Vec<AuditEntry>, StoreError> {
        let query = sqlx::query_as(
            "SELECT audit.*, tokens.label FROM audit LEFT JOIN tokens ON tokens.token_id = audit.actor \
             WHERE seq > $1 ORDER BY seq LIMIT $2",
        );
        Ok(query.bind(signed(after)).bind(i64::from(limit)).fetch_all(&self.pool()).await?)
    }
}

/// See [`Store::recorded`].
pub(super) struct Recorded<'a> {
    pub(super) transaction: Transaction,
    /// One record at a time, so that numbers are unique.
    _numbering: tokio::sync::MutexGuard<'a, ()>,
}

impl Recorded<'_> {
    /// Adds the granted time to the record.
    pub(super) async fn with_seconds(mut self, seconds: f64) -> Result<Self, StoreError> {
        // The newest record is this one: no other is written before the commit.
        let query = sqlx::query("UPDATE audit SET seconds = $1 WHERE seq = (SELECT MAX(seq) FROM audit)");
        query.bind(seconds).execute(&mut *self.transaction).await?;
        Ok(self)
    }

    pub(super) async fn commit(self) -> Result<(), StoreError> {
        Ok(self.transaction.commit().await?)
    }

    /// Executes the recorded change and commits if it changed exactly one row; otherwise nothing is changed or recorded.
    pub(super) async fn change_one(
        mut self,
        query: Query<'_, Any, AnyArguments>,
    ) -> Result<bool, StoreError> {
        let changed = query.execute(&mut *self.transaction).await?.rows_affected();
        if changed == 1 {
            self.commit().await?;
        }
        Ok(changed == 1)
    }
}
