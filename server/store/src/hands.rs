//! Hands that teams uploaded.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::{signed, unix_ms};
use schemars::JsonSchema;
use serde::{Serialize, Serializer};

/// A hand that passed its check.
#[derive(Clone, Debug)]
pub struct NewHand<'a> {
    /// Its id.
    pub hand_id: &'a str,
    /// Its team.
    pub team: &'a str,
    /// Its name, as in `reset`.
    pub name: &'a str,
    /// SHA-256 of the archive, hexadecimal.
    pub sha256: &'a str,
    /// Size of the archive, bytes.
    pub bytes: u64,
    /// Warnings, as a JSON list of strings.
    pub warnings: &'a str,
}

/// A hand as stored.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HandRow {
    /// Its id.
    pub hand_id: String,
    /// Its team.
    pub team: String,
    /// Its name, as in `reset`.
    pub name: String,
    /// SHA-256 of the archive, hexadecimal.
    pub sha256: String,
    /// Size of the archive, bytes.
    pub bytes: i64,
    /// `pending`, `approved` or `rejected`.
    pub status: String,
    /// The organizer's reason for the decision.
    pub note: Option<String>,
    /// Warnings of the check.
    #[serde(serialize_with = "as_json")]
    #[schemars(with = "Vec<String>")]
    pub warnings: String,
    /// Time of the upload, ms since 1970 UTC.
    pub created_unix_ms: i64,
    /// Time of the organizer's decision, ms since 1970 UTC.
    pub decided_unix_ms: Option<i64>,
}

from_row!(HandRow {
    hand_id,
    team,
    name,
    sha256,
    bytes,
    status,
    note,
    warnings,
    created_unix_ms: "created_at",
    decided_unix_ms: "decided_at"
});

/// Serialises a string that is JSON already.
fn as_json<S: Serializer>(text: &str, serializer: S) -> Result<S::Ok, S::Error> {
    serde_json::from_str::<serde_json::Value>(text).unwrap_or_default().serialize(serializer)
}

impl Store {
    /// Stores a hand, which waits for approval.
    pub async fn add_hand(&self, hand: &NewHand<'_>) -> Result<(), StoreError> {
        sqlx::query(
            "INSERT INTO hands (hand_id, team, name, sha256, bytes, status, warnings, created_at) \
             VALUES ($1, $2, $3, $4, $5, 'pending', $6, $7)",
        )
        .bind(hand.hand_id)
        .bind(hand.team)
        .bind(hand.name)
        .bind(hand.sha256)
        .bind(signed(hand.bytes))
        .bind(hand.warnings)
        .bind(unix_ms())
        .execute(&self.pool())
        .await?;
        Ok(())
    }

    /// Hands of one team or of all, oldest first.
    pub async fn hands(&self, team: Option<&str>) -> Result<Vec<HandRow>, StoreError> {
        let query = match team {
            Some(team) => {
                sqlx::query_as("SELECT * FROM hands WHERE team = $1 ORDER BY created_at, hand_id").bind(team)
            }
            None => sqlx::query_as("SELECT * FROM hands ORDER BY created_at, hand_id"),
        };
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// The hand with that id.
    pub async fn hand(&self, hand_id: &str) -> Result<Option<HandRow>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM hands WHERE hand_id = $1").bind(hand_id);
        Ok(query.fetch_optional(&self.pool()).await?)
    }

    /// Digests of archives that are not in the shared storage yet.
    pub async fn unstored_hands(&self) -> Result<Vec<String>, StoreError> {
        let query = sqlx::query_scalar("SELECT DISTINCT sha256 FROM hands WHERE stored_at IS NULL");
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// Notes that the shared storage has an archive.
    pub async fn hand_stored(&self, sha256: &str) -> Result<(), StoreError> {
        let query =
            sqlx::query("UPDATE hands SET stored_at = $1 WHERE sha256 = $2").bind(unix_ms()).bind(sha256);
        query.execute(&self.pool()).await?;
        Ok(())
    }

    /// Approves or rejects a hand; false if it does not exist. A decision can be changed.
    pub async fn decide_hand(
        &self,
        hand_id: &str,
        approved: bool,
        entry: &NewAuditEntry<'_>,
    ) -> Result<bool, StoreError> {
        let change =
            sqlx::query("UPDATE hands SET status = $1, note = $2, decided_at = $3 WHERE hand_id = $4")
                .bind(if approved { "approved" } else { "rejected" })
                .bind(entry.reason)
                .bind(unix_ms())
                .bind(hand_id);
        self.recorded(entry).await?.change_one(change).await
    }
}
