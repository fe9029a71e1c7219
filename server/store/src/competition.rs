//! The state of an official competition, in the table `settings`: all hosts of the competition read it from there.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::host::ENGINE;
use super::number::unix_ms;
use super::schedule;
use super::settings::WRITE;
use super::transaction::Transaction;
use palmares_tasks::identity;
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::AnyConnection;

/// Setting: the phase.
const PHASE: &str = "phase";
/// Setting: begin of the pause, ms since 1970 UTC.
const PAUSED: &str = "paused_at";
/// Setting: time of the last command that ended all sessions, ms since 1970 UTC.
const ENDED: &str = "sessions_ended_at";

/// The phase of an official competition.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema, strum::EnumString, strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CompetitionPhase {
    /// No session can begin.
    #[default]
    Closed,
    /// Sessions can begin.
    Open,
    /// The competition is over for good: the secret behind the seeds is public.
    Revealed,
}

/// The state of an official competition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompetitionState {
    /// Its phase.
    pub phase: CompetitionPhase,
    /// Begin of the pause of all sessions, ms since 1970 UTC; None without a pause.
    pub paused_unix_ms: Option<i64>,
    /// Time of the last command that ended all sessions, ms since 1970 UTC.
    pub ended_unix_ms: Option<i64>,
}

impl CompetitionState {
    fn of(rows: &[(String, String)]) -> Self {
        let value = |key: &str| rows.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str());
        let time = |key: &str| value(key).and_then(|text| text.parse().ok());
        CompetitionState {
            phase: value(PHASE).and_then(|word| word.parse().ok()).unwrap_or_default(),
            paused_unix_ms: time(PAUSED),
            ended_unix_ms: time(ENDED),
        }
    }
}

const READ: &str = "SELECT key, value FROM settings WHERE key IN ('phase', 'paused_at', 'sessions_ended_at')";

/// A command of an organizer on the whole competition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompetitionChange {
    /// Enters a phase.
    Enter(CompetitionPhase),
    /// Pauses all sessions.
    Pause,
    /// Ends the pause of all sessions.
    Resume,
    /// Ends all open sessions; no other can begin.
    EndSessions,
}

impl CompetitionChange {
    /// The state after the command at `now`, ms since 1970 UTC.
    fn applied(self, to: CompetitionState, now: i64) -> CompetitionState {
        match self {
            CompetitionChange::Enter(phase) => CompetitionState { phase, ..to },
            CompetitionChange::Pause => CompetitionState { paused_unix_ms: Some(now), ..to },
            CompetitionChange::Resume => CompetitionState { paused_unix_ms: None, ..to },
            CompetitionChange::EndSessions => {
                CompetitionState { phase: CompetitionPhase::Closed, ended_unix_ms: Some(now), ..to }
            }
        }
    }
}

impl Store {
    /// The state of the competition.
    pub async fn competition_state(&self) -> Result<CompetitionState, StoreError> {
        self.competition_state_by(&mut *self.pool().acquire().await?).await
    }

    /// The same, read by a connection outside the pool.
    pub async fn competition_state_by(
        &self,
        connection: &mut AnyConnection,
    ) -> Result<CompetitionState, StoreError> {
        let rows: Vec<(String, String)> = sqlx::query_as(READ).fetch_all(connection).await?;
        Ok(CompetitionState::of(&rows))
    }

    /// Changes the state of the competition by an organizer's command, if `may` accepts the present state and the number of open
    /// sessions.
    pub async fn change_competition<E>(
        &self,
        change: CompetitionChange,
        entry: &NewAuditEntry<'_>,
        may: impl FnOnce(CompetitionState, i64) -> Result<(), E> + Send,
    ) -> Result<Result<(), E>, StoreError> {
        // The record's number orders commands of all hosts: the state that is read next is the present one.
        let mut recorded = self.recorded(entry).await?;
        let transaction = &mut recorded.transaction;
        let rows: Vec<(String, String)> = sqlx::query_as(READ).fetch_all(&mut **transaction).await?;
        let before = CompetitionState::of(&rows);
        let open = sqlx::query_scalar(OPEN_SESSIONS).fetch_one(&mut **transaction).await?;
        if let Err(refusal) = may(before, open) {
            return Ok(Err(refusal));
        }
        let now = unix_ms();
        let after = change.applied(before, now);
        write(transaction, PHASE, Some(<&str>::from(after.phase).to_owned())).await?;
        if change == CompetitionChange::Enter(CompetitionPhase::Open) {
            write(transaction, ENGINE, Some(identity::engine())).await?;
        }
        write(transaction, PAUSED, after.paused_unix_ms.map(|at| at.to_string())).await?;
        write(transaction, ENDED, after.ended_unix_ms.map(|at| at.to_string())).await?;
        if let (CompetitionChange::Resume, Some(paused)) = (change, before.paused_unix_ms) {
            schedule::extend(transaction, None, paused, now).await?;
        }
        if change == CompetitionChange::EndSessions {
            sqlx::query(
                "UPDATE sessions SET status = 'ended', ended_at = $1 WHERE mode = 'official' AND status = 'open'",
            )
            .bind(now)
            .execute(&mut **transaction)
            .await?;
        }
        recorded.commit().await?;
        Ok(Ok(()))
    }

    /// The official sessions that the command at this time has ended.
    pub async fn sessions_ended_at(&self, at: i64) -> Result<Vec<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT session_id FROM sessions WHERE mode = 'official' AND status = 'ended' AND ended_at = $1",
        );
        Ok(query.bind(at).fetch_all(&self.pool()).await?)
    }

    /// Number of open official sessions.
    pub async fn open_sessions(&self) -> Result<i64, StoreError> {
        Ok(sqlx::query_scalar(OPEN_SESSIONS).fetch_one(&self.pool()).await?)
    }
}

/// Whether an organizer has closed the competition. It stays as it is until the end of the transaction, so that no session begins beside
/// a command that ends all.
pub(super) async fn is_closed(transaction: &mut Transaction) -> Result<bool, StoreError> {
    // Locks the row in Postgres; SQLite locks at the transaction's begin.
    sqlx::query("UPDATE settings SET value = value WHERE key = 'phase'").execute(&mut **transaction).await?;
    let phase: Option<String> = sqlx::query_scalar("SELECT value FROM settings WHERE key = 'phase'")
        .fetch_optional(&mut **transaction)
        .await?;
    Ok(phase.is_some_and(|phase| phase != <&str>::from(CompetitionPhase::Open)))
}

const OPEN_SESSIONS: &str = "SELECT COUNT(*) FROM sessions WHERE mode = 'official' AND status = 'open'";

async fn write(transaction: &mut Transaction, key: &str, value: Option<String>) -> Result<(), StoreError> {
    let query = match value {
        Some(value) => sqlx::query(WRITE).bind(key.to_owned()).bind(value),
        None => sqlx::query("DELETE FROM settings WHERE key = $1").bind(key.to_owned()),
    };
    query.execute(&mut **transaction).await?;
    Ok(())
}
