//! Teams of an official competition.

use super::{Deed, Store, StoreError, unix_ms};
use schemars::JsonSchema;
use serde::Serialize;

/// A team.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct TeamRow {
    /// Its name.
    pub(crate) team: String,
    /// When it was added, ms since 1970 UTC.
    pub(crate) created_unix_ms: i64,
    /// Its tokens that are not revoked.
    pub(crate) live_tokens: i64,
    /// Its sessions that are not voided.
    pub(crate) sessions: i64,
}

from_row!(TeamRow {
    team: "team",
    created_unix_ms: "created_at",
    live_tokens: "live_tokens",
    sessions: "sessions"
});

impl Store {
    /// Adds a team; false when there is one of that name.
    pub(crate) async fn add_team(&self, team: &str, deed: &Deed<'_>) -> Result<bool, StoreError> {
        let mut recorded = self.recorded(deed).await?;
        let added =
            sqlx::query("INSERT INTO teams (team, created_at) VALUES ($1, $2) ON CONFLICT (team) DO NOTHING")
                .bind(team)
                .bind(unix_ms())
                .execute(&mut *recorded.transaction)
                .await?
                .rows_affected();
        // Without a team nothing happened, and nothing is recorded.
        if added == 1 {
            recorded.commit().await?;
        }
        Ok(added == 1)
    }

    /// All teams by name.
    pub(crate) async fn teams(&self) -> Result<Vec<TeamRow>, StoreError> {
        let query = sqlx::query_as(
            "SELECT team, created_at, \
               (SELECT COUNT(*) FROM tokens WHERE tokens.team = teams.team AND revoked_at IS NULL) AS live_tokens, \
               (SELECT COUNT(*) FROM sessions WHERE sessions.team = teams.team AND mode = 'official' \
                  AND status <> 'voided') AS sessions \
             FROM teams ORDER BY team",
        );
        Ok(query.fetch_all(&self.pool).await?)
    }

    /// Whether there is such a team.
    pub(crate) async fn has_team(&self, team: &str) -> Result<bool, StoreError> {
        let query = sqlx::query("SELECT team FROM teams WHERE team = $1").bind(team);
        Ok(query.fetch_optional(&self.pool).await?.is_some())
    }
}
