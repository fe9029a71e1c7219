//! The teams of an official competition.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::unix_ms;
use crate::names;
use schemars::JsonSchema;
use serde::Serialize;

/// A team.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TeamRow {
    /// Its name.
    pub team: String,
    /// Time of its creation, ms since 1970 UTC.
    pub created_unix_ms: i64,
    /// Number of its tokens that are not revoked.
    pub live_tokens: i64,
    /// Number of its official sessions that are not voided.
    pub sessions: i64,
}

from_row!(TeamRow { team, created_unix_ms: "created_at", live_tokens, sessions });

impl Store {
    /// Adds a team, unless a team has the same name or one that looks alike: then that name is returned and nothing is recorded.
    pub async fn add_team(
        &self,
        team: &str,
        entry: &NewAuditEntry<'_>,
    ) -> Result<Option<String>, StoreError> {
        // Audit records are written one at a time, so no other team is added in between.
        let mut recorded = self.recorded(entry).await?;
        let had: Vec<String> = sqlx::query_scalar("SELECT team FROM teams ORDER BY team")
            .fetch_all(&mut *recorded.transaction)
            .await?;
        let had = had.iter().map(String::as_str);
        if let Some(other) = had.clone().find(|had| *had == team).or_else(|| names::like(team, had)) {
            return Ok(Some(other.to_owned()));
        }
        sqlx::query("INSERT INTO teams (team, created_at) VALUES ($1, $2)")
            .bind(team)
            .bind(unix_ms())
            .execute(&mut *recorded.transaction)
            .await?;
        recorded.commit().await?;
        Ok(None)
    }

    /// Whether a team of exactly this name has played here or uploaded a hand.
    pub async fn knows_team(&self, team: &str) -> Result<bool, StoreError> {
        let query = sqlx::query(
            "SELECT team FROM sessions WHERE team = $1 UNION SELECT team FROM hands WHERE team = $1",
        );
        Ok(query.bind(team.to_owned()).fetch_optional(&self.pool()).await?.is_some())
    }

    /// The names of all teams that have played here.
    pub async fn practice_teams(&self) -> Result<Vec<String>, StoreError> {
        let query = sqlx::query_scalar("SELECT DISTINCT team FROM sessions ORDER BY team");
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// All teams, by name.
    pub async fn teams(&self) -> Result<Vec<TeamRow>, StoreError> {
        let query = sqlx::query_as(
            "SELECT team, created_at, \
               (SELECT COUNT(*) FROM tokens WHERE tokens.team = teams.team AND revoked_at IS NULL) AS live_tokens, \
               (SELECT COUNT(*) FROM sessions WHERE sessions.team = teams.team AND mode = 'official' \
                  AND status <> 'voided') AS sessions \
             FROM teams ORDER BY team",
        );
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// Whether the team exists.
    pub async fn has_team(&self, team: &str) -> Result<bool, StoreError> {
        let query = sqlx::query("SELECT team FROM teams WHERE team = $1").bind(team);
        Ok(query.fetch_optional(&self.pool()).await?.is_some())
    }
}
