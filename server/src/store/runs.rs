//! Rows of `runs`.

use super::{Store, StoreError, unix_ms};
use palmares_tasks::{Event, Outcome, Sensing};
use serde::Serialize;
use sqlx::{FromRow, Row};

/// A run that begins.
#[derive(Clone, Debug)]
pub(crate) struct NewRun {
    /// Identifies it.
    pub(crate) run_id: String,
    /// The session it belongs to.
    pub(crate) session_id: String,
    /// Name on the leaderboard.
    pub(crate) team: String,
    /// Task.
    pub(crate) task: String,
    /// Hand.
    pub(crate) hand: String,
    /// How much the controller sees.
    pub(crate) sensing: Sensing,
    /// 64 hexadecimal digits.
    pub(crate) seed_hex: String,
    /// The number behind the seed, in practice.
    pub(crate) seed: Option<u64>,
    /// Program.
    pub(crate) server_version: String,
    /// Commit it was built from.
    pub(crate) build_hash: String,
}

/// How a run ended.
#[derive(Clone, Debug)]
pub(crate) struct FinishedRun<'a> {
    /// Which.
    pub(crate) run_id: &'a str,
    /// `practice` or `voided`.
    pub(crate) status: &'a str,
    /// What it is worth.
    pub(crate) outcome: &'a Outcome,
    /// For people: what happened, where the reason does not say it.
    pub(crate) note: Option<&'a str>,
}

/// A run as `GET /v1/runs/{id}` shows it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RunRecord {
    run_id: String,
    session_id: String,
    team: String,
    task: String,
    hand: String,
    mode: String,
    sensing: String,
    status: String,
    reason: Option<String>,
    note: Option<String>,
    score: Option<f64>,
    in_goal: Option<i64>,
    outside: Option<i64>,
    ticks: Option<i64>,
    sim_time_s: Option<f64>,
    state_hash: Option<String>,
    seed: Option<i64>,
    seed_hex: String,
    started_unix_ms: i64,
    ended_unix_ms: Option<i64>,
    server_version: String,
    build_hash: String,
    events: Vec<Event>,
}

impl FromRow<'_, sqlx::sqlite::SqliteRow> for RunRecord {
    fn from_row(row: &sqlx::sqlite::SqliteRow) -> Result<Self, sqlx::Error> {
        let events: Option<String> = row.try_get("events")?;
        let events = match events {
            Some(json) => serde_json::from_str(&json).map_err(|error| sqlx::Error::ColumnDecode {
                index: "events".into(),
                source: error.into(),
            })?,
            None => Vec::new(),
        };
        Ok(RunRecord {
            run_id: row.try_get("run_id")?,
            session_id: row.try_get("session_id")?,
            team: row.try_get("team")?,
            task: row.try_get("task")?,
            hand: row.try_get("hand")?,
            mode: row.try_get("mode")?,
            sensing: row.try_get("sensing")?,
            status: row.try_get("status")?,
            reason: row.try_get("reason")?,
            note: row.try_get("note")?,
            score: row.try_get("score")?,
            in_goal: row.try_get("in_goal")?,
            outside: row.try_get("outside")?,
            ticks: row.try_get("ticks")?,
            sim_time_s: row.try_get("sim_time_s")?,
            state_hash: row.try_get("state_hash")?,
            seed: row.try_get("seed")?,
            seed_hex: row.try_get("seed_hex")?,
            started_unix_ms: row.try_get("started_at")?,
            ended_unix_ms: row.try_get("ended_at")?,
            server_version: row.try_get("server_version")?,
            build_hash: row.try_get("build_hash")?,
            events,
        })
    }
}

/// The word serde writes for a value without fields.
fn word<T: Serialize>(value: &T) -> Option<String> {
    serde_json::to_value(value).ok()?.as_str().map(str::to_owned)
}

/// SQL integers are signed; nothing we count comes near the end.
fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

impl Store {
    /// Writes a lockstep run that begins now.
    pub(crate) async fn begin_run(&self, run: &NewRun) -> Result<(), StoreError> {
        sqlx::query(
            "INSERT INTO runs (run_id, session_id, team, task, hand, mode, sensing, seed_hex, seed, \
             server_version, build_hash, started_at, status) \
             VALUES ($1, $2, $3, $4, $5, 'lockstep', $6, $7, $8, $9, $10, $11, 'open')",
        )
        .bind(&run.run_id)
        .bind(&run.session_id)
        .bind(&run.team)
        .bind(&run.task)
        .bind(&run.hand)
        .bind(word(&run.sensing))
        .bind(&run.seed_hex)
        .bind(run.seed.map(signed))
        .bind(&run.server_version)
        .bind(&run.build_hash)
        .bind(unix_ms())
        .execute(&self.pool)
        .await?;
        Ok(())
    }

    /// Writes how a run ended. It is on the disk when this returns; doing it twice changes nothing more.
    pub(crate) async fn finish_run(&self, run: &FinishedRun<'_>) -> Result<(), StoreError> {
        let outcome = run.outcome;
        let events =
            serde_json::to_string(&outcome.events).map_err(|error| sqlx::Error::Encode(error.into()))?;
        sqlx::query(
            "UPDATE runs SET status = $1, reason = $2, note = $3, ticks = $4, sim_time_s = $5, score = $6, \
             in_goal = $7, outside = $8, state_hash = $9, events = $10, ended_at = $11 \
             WHERE run_id = $12 AND status = 'open'",
        )
        .bind(run.status)
        .bind(word(&outcome.reason))
        .bind(run.note)
        .bind(signed(outcome.ticks))
        .bind(outcome.sim_time_s)
        .bind(outcome.score)
        .bind(i64::from(outcome.in_goal))
        .bind(i64::from(outcome.outside))
        .bind(&outcome.state_hash)
        .bind(events)
        .bind(unix_ms())
        .bind(run.run_id)
        .execute(&self.pool)
        .await?;
        Ok(())
    }

    /// The run of that id.
    pub(crate) async fn run(&self, run_id: &str) -> Result<Option<RunRecord>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM runs WHERE run_id = $1").bind(run_id);
        Ok(query.fetch_optional(&self.pool).await?)
    }

    /// Marks what an earlier process left open: its runs as aborted, its sessions as ended. Returns the runs.
    pub(crate) async fn abort_open_runs(&self) -> Result<Vec<String>, StoreError> {
        let mut transaction = self.pool.begin().await?;
        let runs: Vec<(String,)> = sqlx::query_as(
            "UPDATE runs SET status = 'aborted', note = 'interrupted: the server stopped', ended_at = $1 \
             WHERE status = 'open' RETURNING run_id",
        )
        .bind(unix_ms())
        .fetch_all(&mut *transaction)
        .await?;
        sqlx::query("UPDATE sessions SET ended_at = $1 WHERE ended_at IS NULL")
            .bind(unix_ms())
            .execute(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(runs.into_iter().map(|(run_id,)| run_id).collect())
    }
}
