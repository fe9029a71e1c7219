//! Rows of `sessions`.

use super::{Store, StoreError, unix_ms};

/// A session that begins.
#[derive(Clone, Debug)]
pub(crate) struct NewSession {
    /// Identifies it.
    pub(crate) session_id: String,
    /// Name on the leaderboard.
    pub(crate) team: String,
    /// What the client said of itself.
    pub(crate) client_version: Option<String>,
    /// s; none for a session without a limit.
    pub(crate) limit_s: Option<f64>,
}

impl Store {
    /// Writes a practice session that begins now.
    pub(crate) async fn begin_session(&self, session: &NewSession) -> Result<(), StoreError> {
        sqlx::query(
            "INSERT INTO sessions (session_id, team, client_version, mode, limit_s, created_at) \
             VALUES ($1, $2, $3, 'practice', $4, $5)",
        )
        .bind(&session.session_id)
        .bind(&session.team)
        .bind(&session.client_version)
        .bind(session.limit_s)
        .bind(unix_ms())
        .execute(&self.pool)
        .await?;
        Ok(())
    }

    /// Marks a session as ended now.
    pub(crate) async fn end_session(&self, session_id: &str) -> Result<(), StoreError> {
        sqlx::query("UPDATE sessions SET ended_at = $1 WHERE session_id = $2 AND ended_at IS NULL")
            .bind(unix_ms())
            .bind(session_id)
            .execute(&self.pool)
            .await?;
        Ok(())
    }
}
