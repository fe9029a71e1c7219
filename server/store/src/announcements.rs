//! Announcements of organizers.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::unix_ms;
use schemars::JsonSchema;
use serde::Serialize;

/// An announcement of an organizer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Announcement {
    /// Counts up from 1.
    pub id: i64,
    /// Its text; empty to withdraw the one before.
    pub text: String,
    /// Time, ms since 1970 UTC.
    pub unix_ms: i64,
}

from_row!(Announcement { id, text, unix_ms: "at" });

impl Store {
    /// Stores an announcement.
    pub async fn announce(&self, text: &str, entry: &NewAuditEntry<'_>) -> Result<Announcement, StoreError> {
        // Audit records are written one at a time, so the number is unique.
        let mut recorded = self.recorded(entry).await?;
        let last: i64 = sqlx::query_scalar("SELECT COALESCE(MAX(id), 0) FROM announcements")
            .fetch_one(&mut *recorded.transaction)
            .await?;
        let announcement = Announcement { id: last + 1, text: text.to_owned(), unix_ms: unix_ms() };
        sqlx::query("INSERT INTO announcements (id, at, text) VALUES ($1, $2, $3)")
            .bind(announcement.id)
            .bind(announcement.unix_ms)
            .bind(text)
            .execute(&mut *recorded.transaction)
            .await?;
        recorded.commit().await?;
        Ok(announcement)
    }

    /// The newest announcements first, at most `limit` of them.
    pub async fn announcements(&self, limit: u32) -> Result<Vec<Announcement>, StoreError> {
        let query = sqlx::query_as("SELECT id, at, text FROM announcements ORDER BY id DESC LIMIT $1");
        Ok(query.bind(i64::from(limit)).fetch_all(&self.pool()).await?)
    }
}
