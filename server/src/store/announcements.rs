//! What organizers told everybody.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::unix_ms;
use schemars::JsonSchema;
use serde::Serialize;

/// Something that an organizer told everybody.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct Announcement {
    /// Counts up from 1.
    pub(crate) id: i64,
    /// What; empty when the one before no longer holds.
    pub(crate) text: String,
    /// When, ms since 1970 UTC.
    pub(crate) unix_ms: i64,
}

from_row!(Announcement { id, text, unix_ms: "at" });

impl Store {
    /// Keeps an announcement.
    pub(crate) async fn announce(
        &self,
        text: &str,
        entry: &NewAuditEntry<'_>,
    ) -> Result<Announcement, StoreError> {
        // One record at a time: nobody else numbers an announcement meanwhile.
        let mut recorded = self.recorded(entry).await?;
        let last: i64 = sqlx::query_scalar("SELECT COALESCE(MAX(id), 0) FROM announcements")
            .fetch_one(&mut *recorded.transaction)
            .await?;
        let told = Announcement { id: last + 1, text: text.to_owned(), unix_ms: unix_ms() };
        sqlx::query("INSERT INTO announcements (id, at, text) VALUES ($1, $2, $3)")
            .bind(told.id)
            .bind(told.unix_ms)
            .bind(text)
            .execute(&mut *recorded.transaction)
            .await?;
        recorded.commit().await?;
        Ok(told)
    }

    /// The newest announcements first, at most `limit` of them.
    pub(crate) async fn announcements(&self, limit: u32) -> Result<Vec<Announcement>, StoreError> {
        let query = sqlx::query_as("SELECT id, at, text FROM announcements ORDER BY id DESC LIMIT $1");
        Ok(query.bind(i64::from(limit)).fetch_all(&self.pool).await?)
    }
}
