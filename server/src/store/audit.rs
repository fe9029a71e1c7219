//! Who decided what, when and why. Records are only ever added.

use super::database::Store;
use super::error::StoreError;
use super::number::{signed, unix_ms};
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::any::AnyArguments;
use sqlx::query::Query;
use sqlx::{Any, Transaction};

/// Something an organizer does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewAuditEntry<'a> {
    /// The token it was done with.
    pub(crate) actor: &'a str,
    /// What, as `session.pause`.
    pub(crate) action: &'a str,
    /// To whom or what.
    pub(crate) subject: &'a str,
    /// Why, in the organizer's words.
    pub(crate) reason: Option<&'a str>,
}

/// A record.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct AuditEntry {
    /// Counts up from 1.
    pub(crate) seq: i64,
    /// When, ms since 1970 UTC.
    pub(crate) unix_ms: i64,
    /// The token it was done with, or `server`.
    pub(crate) actor: String,
    /// What.
    pub(crate) action: String,
    /// To whom or what.
    pub(crate) subject: String,
    /// Why.
    pub(crate) reason: Option<String>,
}

from_row!(AuditEntry { seq, unix_ms: "at", actor, action, subject, reason });

impl Store {
    /// A transaction that begins with a record of what it will do: both are stored or neither.
    pub(super) async fn recorded(&self, entry: &NewAuditEntry<'_>) -> Result<Recorded<'_>, StoreError> {
        let numbering = self.audit.lock().await;
        let mut transaction = self.write().await?;
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

    /// Writes a record of something that changes nothing in the database.
    pub(crate) async fn record(&self, entry: &NewAuditEntry<'_>) -> Result<(), StoreError> {
        self.recorded(entry).await?.commit().await
    }

    /// The records after number `after`, oldest first, at most `limit` of them.
    pub(crate) async fn audit(&self, after: u64, limit: u32) -> Result<Vec<AuditEntry>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM audit WHERE seq > $1 ORDER BY seq LIMIT $2");
        Ok(query.bind(signed(after)).bind(i64::from(limit)).fetch_all(&self.pool).await?)
    }
}

/// See [`Store::recorded`].
pub(super) struct Recorded<'a> {
    pub(super) transaction: Transaction<'static, Any>,
    /// Numbers must not be given twice: one record at a time.
    _numbering: tokio::sync::MutexGuard<'a, ()>,
}

impl Recorded<'_> {
    pub(super) async fn commit(self) -> Result<(), StoreError> {
        Ok(self.transaction.commit().await?)
    }

    /// Does what is recorded, and commits when it changed the one row it was meant for; else nothing happened, and nothing
    /// is recorded.
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
