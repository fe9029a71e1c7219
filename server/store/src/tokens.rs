//! Tokens: a public id and the hash of a secret.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::unix_ms;
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::AnyConnection;

/// A new token.
#[derive(Clone, Debug)]
pub struct NewToken<'a> {
    /// Its public id.
    pub token_id: &'a str,
    /// `team`, `organizer` or `viewer`.
    pub role: &'a str,
    /// The team, for the role `team`.
    pub team: Option<&'a str>,
    /// Its holder, for people.
    pub label: &'a str,
    /// SHA-256 of its secret, hexadecimal.
    pub secret_hash: &'a str,
}

/// A token as stored.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TokenRow {
    /// Its public id.
    pub token_id: String,
    /// `team`, `organizer` or `viewer`.
    pub role: String,
    /// Its team, for the role `team`.
    pub team: Option<String>,
    /// Its holder, for people.
    pub label: String,
    /// Not serialised.
    #[serde(skip)]
    pub secret_hash: String,
    /// Time of its creation, ms since 1970 UTC.
    pub created_unix_ms: i64,
    /// Time of its revocation, ms since 1970 UTC.
    pub revoked_unix_ms: Option<i64>,
}

from_row!(TokenRow {
    token_id,
    role,
    team,
    label,
    secret_hash,
    created_unix_ms: "created_at",
    revoked_unix_ms: "revoked_at"
});

/// Revokes all valid tokens of a team; returns their ids.
async fn revoke_all_of(team: &str, connection: &mut AnyConnection) -> Result<Vec<String>, StoreError> {
    let query = sqlx::query_scalar(
        "UPDATE tokens SET revoked_at = $1 WHERE team = $2 AND revoked_at IS NULL RETURNING token_id",
    );
    Ok(query.bind(unix_ms()).bind(team).fetch_all(connection).await?)
}

impl Store {
    /// Stores a token. With `only`, the same transaction revokes the other valid tokens of the team; their ids are returned.
    pub async fn add_token(
        &self,
        token: &NewToken<'_>,
        only: bool,
        entry: &NewAuditEntry<'_>,
    ) -> Result<Vec<String>, StoreError> {
        let mut recorded = self.recorded(entry).await?;
        let revoked = match token.team {
            Some(team) if only => revoke_all_of(team, &mut recorded.transaction).await?,
            _ => Vec::new(),
        };
        sqlx::query(
            "INSERT INTO tokens (token_id, role, team, label, secret_hash, created_at) \
             VALUES ($1, $2, $3, $4, $5, $6)",
        )
        .bind(token.token_id)
        .bind(token.role)
        .bind(token.team)
        .bind(token.label)
        .bind(token.secret_hash)
        .bind(unix_ms())
        .execute(&mut *recorded.transaction)
        .await?;
        recorded.commit().await?;
        Ok(revoked)
    }

    /// The token with that id, valid or revoked.
    pub async fn token(&self, token_id: &str) -> Result<Option<TokenRow>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM tokens WHERE token_id = $1").bind(token_id);
        Ok(query.fetch_optional(&self.pool()).await?)
    }

    /// The label of a team's newest token.
    pub async fn team_label(&self, team: &str) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT label FROM tokens WHERE team = $1 ORDER BY created_at DESC, token_id LIMIT 1",
        );
        Ok(query.bind(team).fetch_optional(&self.pool()).await?)
    }

    /// All tokens, oldest first.
    pub async fn tokens(&self) -> Result<Vec<TokenRow>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM tokens ORDER BY created_at, token_id");
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// Revokes a token; false if it is not valid, or the last one of an organizer, which stays.
    pub async fn revoke_token(&self, token_id: &str, entry: &NewAuditEntry<'_>) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE tokens SET revoked_at = $1 WHERE token_id = $2 AND revoked_at IS NULL AND (role <> 'organizer' \
             OR (SELECT COUNT(*) FROM tokens WHERE role = 'organizer' AND revoked_at IS NULL) > 1)",
        )
        .bind(unix_ms())
        .bind(token_id);
        self.recorded(entry).await?.change_one(change).await
    }

    /// Ids of all revoked tokens, read by a connection outside the pool.
    pub async fn revoked_tokens(&self, connection: &mut AnyConnection) -> Result<Vec<String>, StoreError> {
        let query = sqlx::query_scalar("SELECT token_id FROM tokens WHERE revoked_at IS NOT NULL");
        Ok(query.fetch_all(connection).await?)
    }

    /// Revokes all valid tokens of a team; returns their ids.
    pub async fn revoke_team(
        &self,
        team: &str,
        entry: &NewAuditEntry<'_>,
    ) -> Result<Vec<String>, StoreError> {
        let mut recorded = self.recorded(entry).await?;
        let revoked = revoke_all_of(team, &mut recorded.transaction).await?;
        recorded.commit().await?;
        Ok(revoked)
    }

    /// Whether an organizer has a valid token.
    pub async fn has_organizer(&self) -> Result<bool, StoreError> {
        let query = sqlx::query(
            "SELECT token_id FROM tokens WHERE role = 'organizer' AND revoked_at IS NULL LIMIT 1",
        );
        Ok(query.fetch_optional(&self.pool()).await?.is_some())
    }
}
