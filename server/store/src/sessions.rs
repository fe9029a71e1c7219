//! The table `sessions`.

use super::audit::NewAuditEntry;
use super::clocks::{ClockRow, ROUNDING_S, bind_double};
use super::competition;
use super::database::Store;
use super::error::StoreError;
use super::host::{FIRST_EPOCH, Held};
use super::number::unix_ms;
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::AnyConnection;

/// A new session.
#[derive(Clone, Debug)]
pub struct NewSession {
    /// Its id.
    pub session_id: String,
    /// Its team.
    pub team: String,
    /// Version of the client, as the client gives it.
    pub client_version: Option<String>,
    /// Its length, s; None without a limit.
    pub limit_s: Option<f64>,
    /// `practice` or `official`.
    pub mode: &'static str,
    /// SHA-256 of its resume token, hexadecimal.
    pub token_hash: Option<String>,
}

/// An official session of an earlier process.
#[derive(Clone, Debug, PartialEq)]
pub struct ResumableSession {
    /// Its id.
    pub session_id: String,
    /// Its team.
    pub team: String,
    /// Whether it is open; otherwise an organizer has ended it.
    pub open: bool,
    /// SHA-256 of its resume token, hexadecimal.
    pub token_hash: String,
    /// Its length, s.
    pub limit_s: Option<f64>,
    /// Its clock, as saved last.
    pub clock: ClockRow,
    /// Whether an organizer has paused it.
    pub paused: bool,
    /// The epoch of its owner.
    pub epoch: i64,
}

/// A session, as in the lists for organizers and teams.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SessionRow {
    /// Its id.
    pub session_id: String,
    /// Its team.
    pub team: String,
    /// `practice` or `official`.
    pub mode: String,
    /// `open`, `ended` or `voided`.
    pub status: String,
    /// Version of the client, as the client gives it.
    pub client_version: Option<String>,
    /// Its length, s.
    pub limit_s: Option<f64>,
    /// Wall-clock time of its clock, without pauses, s.
    pub clock_wall_s: f64,
    /// Simulated time of its clock, s.
    pub clock_simulated_s: f64,
    /// Time given back, s.
    pub refunded_s: f64,
    /// Begin of the current pause, ms since 1970 UTC.
    pub paused_unix_ms: Option<i64>,
    /// Number of pauses.
    pub pauses: i64,
    /// Its begin, ms since 1970 UTC.
    pub created_unix_ms: i64,
    /// Its end, ms since 1970 UTC.
    pub ended_unix_ms: Option<i64>,
    /// Number of its runs.
    pub runs: i64,
}

from_row!(SessionRow {
    session_id,
    team,
    mode,
    status,
    client_version,
    limit_s,
    clock_wall_s,
    clock_simulated_s,
    refunded_s,
    paused_unix_ms: "paused_at",
    pauses,
    created_unix_ms: "created_at",
    ended_unix_ms: "ended_at",
    runs
});

const SESSION_ROW: &str = "SELECT session_id, team, mode, status, client_version, limit_s, clock_wall_s, \
     clock_simulated_s, refunded_s, paused_at, created_at, ended_at, \
     (SELECT COUNT(*) FROM audit WHERE action = 'session.pause' AND subject = sessions.session_id) AS pauses, \
     (SELECT COUNT(*) FROM runs WHERE runs.session_id = sessions.session_id) AS runs FROM sessions ";

const COUNT_OFFICIAL: &str =
    "SELECT COUNT(*) FROM sessions WHERE team = $1 AND mode = 'official' AND status <> 'voided'";

impl Store {
    /// Stores a new session of this process, in its first epoch. False, and nothing is stored, if the team already has `max` official
    /// sessions that are not voided, or if an organizer has closed the competition.
    pub async fn begin_session(&self, session: &NewSession, max: Option<u32>) -> Result<bool, StoreError> {
        let mut transaction = self.write().await?;
        if let Some(max) = max {
            // Locks the team's row in Postgres; SQLite locks at the transaction's begin.
            sqlx::query("UPDATE teams SET created_at = created_at WHERE team = $1")
                .bind(&session.team)
                .execute(&mut *transaction)
                .await?;
            let had: i64 =
                sqlx::query_scalar(COUNT_OFFICIAL).bind(&session.team).fetch_one(&mut *transaction).await?;
            if had >= i64::from(max) || competition::is_closed(&mut transaction).await? {
                return Ok(false);
            }
        }
        let query = sqlx::query(
            "INSERT INTO sessions (session_id, team, client_version, mode, limit_s, created_at, token_hash, owner, \
             owner_incarnation, epoch) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
        )
        .bind(session.session_id.clone())
        .bind(session.team.clone())
        .bind(session.client_version.clone())
        .bind(session.mode);
        bind_double(query, session.limit_s)
            .bind(unix_ms())
            .bind(session.token_hash.clone())
            .bind(self.host.host_id.clone())
            .bind(self.host.incarnation())
            .bind(FIRST_EPOCH)
            .execute(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(true)
    }

    /// Marks a session as ended, and gives it up.
    pub async fn end_session(&self, held: &Held) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        sqlx::query(
            "UPDATE sessions SET ended_at = COALESCE(ended_at, $1), owner = NULL, \
             status = CASE status WHEN 'open' THEN 'ended' ELSE status END WHERE session_id = $2",
        )
        .bind(unix_ms())
        .bind(held.session_id.clone())
        .execute(&mut *transaction)
        .await?;
        Ok(transaction.commit().await?)
    }

    /// An official session, to be continued or ended by this process, which owns it.
    pub async fn resumable_session(&self, held: &Held) -> Result<Option<ResumableSession>, StoreError> {
        type Row = (String, String, String, Option<f64>, i64, f64, f64, f64, Option<f64>, Option<i64>);
        let row: Option<Row> = sqlx::query_as(
            "SELECT team, status, token_hash, limit_s, clock_started, clock_wall_s, clock_simulated_s, refunded_s, \
             run_from_s, paused_at FROM sessions WHERE session_id = $1 AND epoch = $2 AND mode = 'official' \
             AND token_hash IS NOT NULL",
        )
        .bind(held.session_id.clone())
        .bind(held.epoch)
        .fetch_optional(&self.pool())
        .await?;
        let session = |row: Row| {
            let (
                team,
                status,
                token_hash,
                limit_s,
                started,
                wall_s,
                simulated_s,
                refunded_s,
                run_from_s,
                paused_at,
            ) = row;
            let clock = ClockRow { started: started != 0, wall_s, simulated_s, refunded_s, run_from_s };
            let session_id = held.session_id.clone();
            let (open, paused, epoch) = (status == "open", paused_at.is_some(), held.epoch);
            ResumableSession { session_id, team, open, token_hash, limit_s, clock, paused, epoch }
        };
        Ok(row.map(session))
    }

    /// The sessions, newest first; of one team or of all.
    pub async fn sessions(&self, team: Option<&str>) -> Result<Vec<SessionRow>, StoreError> {
        let order = "ORDER BY created_at DESC, session_id";
        let (everyone, one) =
            (format!("{SESSION_ROW} {order}"), format!("{SESSION_ROW} WHERE team = $1 {order}"));
        let query = match team {
            Some(team) => sqlx::query_as(sqlx::AssertSqlSafe(one)).bind(team.to_owned()),
            None => sqlx::query_as(sqlx::AssertSqlSafe(everyone)),
        };
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// The open official sessions, newest first.
    pub async fn open_official_sessions(&self) -> Result<Vec<SessionRow>, StoreError> {
        let sql = format!(
            "{SESSION_ROW} WHERE mode = 'official' AND status = 'open' ORDER BY created_at DESC, session_id"
        );
        Ok(sqlx::query_as(sqlx::AssertSqlSafe(sql)).fetch_all(&self.pool()).await?)
    }

    /// The session of that id.
    pub async fn session(&self, session_id: &str) -> Result<Option<SessionRow>, StoreError> {
        let sql = sqlx::AssertSqlSafe(format!("{SESSION_ROW} WHERE session_id = $1"));
        Ok(sqlx::query_as(sql).bind(session_id.to_owned()).fetch_optional(&self.pool()).await?)
    }

    /// Marks an open session as paused or not; false if nothing changes.
    pub async fn pause_session(
        &self,
        session_id: &str,
        paused: bool,
        entry: &NewAuditEntry<'_>,
    ) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE sessions SET paused_at = $1 WHERE session_id = $2 AND status = 'open' \
             AND (paused_at IS NULL) = ($1 IS NOT NULL)",
        );
        let change = change.bind(paused.then(unix_ms)).bind(session_id);
        self.recorded(entry).await?.change_one(change).await
    }

    /// Makes a session longer and opens it again if it has ended. False if there is no such session.
    pub async fn grant_time(
        &self,
        session_id: &str,
        seconds: f64,
        entry: &NewAuditEntry<'_>,
    ) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE sessions SET limit_s = limit_s + $1, status = 'open', ended_at = NULL \
             WHERE session_id = $2 AND mode = 'official' AND status <> 'voided'",
        )
        .bind(seconds)
        .bind(session_id);
        self.recorded(entry).await?.with_seconds(seconds).await?.change_one(change).await
    }

    /// Takes granted time back. The inner error has the time that was granted in all, s, which is less than that.
    pub async fn take_back_time(
        &self,
        session_id: &str,
        seconds: f64,
        entry: &NewAuditEntry<'_>,
    ) -> Result<Result<bool, f64>, StoreError> {
        let mut recorded = self.recorded(entry).await?.with_seconds(-seconds).await?;
        let granted_s: Option<f64> = sqlx::query_scalar(
            "SELECT SUM(seconds) FROM audit WHERE action = $1 AND subject = $2 AND seq < (SELECT MAX(seq) FROM audit)",
        )
        .bind(entry.action)
        .bind(session_id)
        .fetch_one(&mut *recorded.transaction)
        .await?;
        let granted_s = granted_s.unwrap_or_default();
        if seconds > granted_s + ROUNDING_S {
            return Ok(Err(granted_s));
        }
        let change = sqlx::query(
            "UPDATE sessions SET limit_s = limit_s - $1 WHERE session_id = $2 AND mode = 'official' AND status <> 'voided'",
        );
        Ok(Ok(recorded.change_one(change.bind(seconds).bind(session_id)).await?))
    }

    /// Ends an open session by an organizer's command; false if it is not open.
    pub async fn order_end(&self, session_id: &str, entry: &NewAuditEntry<'_>) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE sessions SET status = 'ended', ended_at = $1 WHERE session_id = $2 AND status = 'open'",
        )
        .bind(unix_ms())
        .bind(session_id);
        self.recorded(entry).await?.change_one(change).await
    }

    /// The open official session of a team, with the hash of its resume token.
    pub async fn open_session_of(&self, team: &str) -> Result<Option<(String, String)>, StoreError> {
        let query = sqlx::query_as(
            "SELECT session_id, token_hash FROM sessions WHERE team = $1 AND mode = 'official' AND status = 'open' \
             AND token_hash IS NOT NULL ORDER BY created_at LIMIT 1",
        );
        Ok(query.bind(team).fetch_optional(&self.pool()).await?)
    }

    /// Number of sessions that a team has had of those that it may have.
    pub async fn official_sessions_of(&self, team: &str) -> Result<u32, StoreError> {
        let had: i64 = sqlx::query_scalar(COUNT_OFFICIAL).bind(team).fetch_one(&self.pool()).await?;
        Ok(u32::try_from(had).unwrap_or(u32::MAX))
    }

    /// The open official session with this hash of its resume token.
    pub async fn open_session_by_token(&self, token_hash: &str) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT session_id FROM sessions WHERE token_hash = $1 AND mode = 'official' AND status = 'open' LIMIT 1",
        );
        Ok(query.bind(token_hash.to_owned()).fetch_optional(&self.pool()).await?)
    }

    /// Replaces the resume token of a session.
    pub async fn set_resume_token(&self, held: &Held, token_hash: &str) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        sqlx::query("UPDATE sessions SET token_hash = $1 WHERE session_id = $2")
            .bind(token_hash)
            .bind(held.session_id.clone())
            .execute(&mut *transaction)
            .await?;
        Ok(transaction.commit().await?)
    }

    /// The team of a resume token, by its hash.
    pub async fn team_of_resume_token(&self, token_hash: &str) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar("SELECT team FROM sessions WHERE token_hash = $1 LIMIT 1");
        Ok(query.bind(token_hash).fetch_optional(&self.pool()).await?)
    }

    /// Voids a session and its runs: they count for nothing, and the team may have another session. False if there is no such session, or
    /// it is void already.
    pub async fn void_session(
        &self,
        session_id: &str,
        entry: &NewAuditEntry<'_>,
    ) -> Result<bool, StoreError> {
        let mut recorded = self.recorded(entry).await?;
        let changed = sqlx::query(
            "UPDATE sessions SET status = 'voided', ended_at = COALESCE(ended_at, $1) \
             WHERE session_id = $2 AND status <> 'voided'",
        )
        .bind(unix_ms())
        .bind(session_id)
        .execute(&mut *recorded.transaction)
        .await?
        .rows_affected();
        if changed == 1 {
            void_runs(&mut recorded.transaction, session_id, entry.reason).await?;
            recorded.commit().await?;
        }
        Ok(changed == 1)
    }
}

async fn void_runs(
    connection: &mut AnyConnection,
    session_id: &str,
    note: Option<&str>,
) -> Result<(), StoreError> {
    // An open run becomes void when its session closes it. A void session gets no refunds.
    sqlx::query(
        "UPDATE runs SET status = 'voided', note = $1, taken_wall_s = NULL, taken_simulated_s = NULL \
         WHERE session_id = $2 AND status NOT IN ('open', 'voided')",
    )
    .bind(note)
    .bind(session_id)
    .execute(connection)
    .await?;
    Ok(())
}
