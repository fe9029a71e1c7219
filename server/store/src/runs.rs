//! The table `runs`.

use super::clocks::{ClockRow, write_clock};
use super::database::Store;
use super::error::StoreError;
use super::host::Held;
use super::location::Dialect;
use super::number::{signed, unix_ms};
use super::similar_runs::SimilarRun;
use super::verification::STUCK_TRIES;
use palmares_tasks::{Event, Outcome, Sensing, identity};
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::any::AnyRow;
use sqlx::{AssertSqlSafe, Row};

/// Key of the advisory lock on Postgres under which ended runs get their numbers: "plm_ends" as a number.
const NUMBERING_KEY: i64 = i64::from_be_bytes(*b"plm_ends");

/// A new run.
#[derive(Clone, Debug)]
pub struct NewRun {
    /// Its id.
    pub run_id: String,
    /// Its team.
    pub team: String,
    /// Task.
    pub task: String,
    /// Hand.
    pub hand: String,
    /// SHA-256 of the hand's archive, if the team uploaded it.
    pub hand_sha256: Option<String>,
    /// `lockstep` or `realtime`.
    pub mode: &'static str,
    /// Sensors only, or also the true state.
    pub sensing: Sensing,
    /// The seed, 64 hexadecimal digits.
    pub seed_hex: String,
    /// The number behind the seed, in practice.
    pub seed: Option<u64>,
    /// Number of the run among the team's runs of this task, in an official session.
    pub k: Option<u64>,
    /// Version of the server.
    pub server_version: String,
    /// Commit of its build.
    pub build_hash: String,
    /// Header of its replay as JSON, if the run can continue on another host.
    pub header: Option<String>,
}

/// The end of a run.
#[derive(Clone, Debug)]
pub struct FinishedRunRow<'a> {
    /// Its session.
    pub held: &'a Held,
    /// The run.
    pub run_id: &'a str,
    /// `practice`, `provisional`, `aborted` or `voided`.
    pub status: &'a str,
    /// Score, reason and counts.
    pub outcome: &'a Outcome,
    /// A note for people, in addition to the reason.
    pub note: Option<&'a str>,
    /// Ticks of a realtime run without a new action.
    pub missed_ticks: u64,
    /// Time that it has spent, refunded if it is voided later: wall-clock and simulated, s.
    pub cost_s: (f64, f64),
    /// The session's clock from now on, for sessions whose clock is saved.
    pub clock: Option<ClockRow>,
    /// Path and SHA-256 of its replay.
    pub replay: Option<(&'a str, &'a str)>,
    /// Time of its end in the replay, ms since 1970 UTC; without it the present. A replay that is written again has the same bytes.
    pub ended_unix_ms: Option<i64>,
}

/// An open run whose host is gone.
#[derive(Clone, Debug)]
pub struct InterruptedRun {
    /// The run.
    pub run_id: String,
    /// Header of its replay as JSON.
    pub header: String,
    /// Wall-clock time of the session, as saved last in the run, s.
    pub wall_s: Option<f64>,
    /// Time given back, as saved last in the run, s.
    pub refunded_s: Option<f64>,
}

from_row!(InterruptedRun { run_id, header, wall_s: "run_wall_s", refunded_s: "run_refunded_s" });

/// A run, as in `GET /v1/runs/{id}`.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunRecord {
    /// Its id.
    pub run_id: String,
    /// Its session; left out where the client may not know it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub session_id: Option<String>,
    /// Its team.
    pub team: String,
    task: String,
    /// Hand.
    pub hand: String,
    mode: String,
    sensing: String,
    /// `open`, `practice`, `provisional`, `verified`, `rejected`, `aborted` or `voided`.
    pub status: String,
    reason: Option<String>,
    note: Option<String>,
    score: Option<f64>,
    in_goal: Option<i64>,
    outside: Option<i64>,
    ticks: Option<i64>,
    sim_time_s: Option<f64>,
    missed_ticks: i64,
    state_hash: Option<String>,
    /// In practice, the number with which `reset` builds the scene again.
    pub seed: Option<i64>,
    /// The seed; null while it is hidden.
    pub seed_hex: Option<String>,
    /// Number of the run among the team's runs of this task; official runs only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k: Option<i64>,
    started_unix_ms: i64,
    ended_unix_ms: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    replay_sha256: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    verify_note: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    verified_unix_ms: Option<i64>,
    /// `waiting` for its verification, also for another one after a verdict, or `stuck`: three tries or more were without a verdict, or
    /// the run is of another engine. Left out otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    verify_state: Option<&'static str>,
    /// Since when it waits, ms since 1970 UTC.
    #[serde(skip_serializing_if = "Option::is_none")]
    verify_since_unix_ms: Option<i64>,
    /// The host that verifies it now; left out if none does, and where there is one server only. For organizers only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verify_host: Option<String>,
    /// Number of tries without a verdict, the present one included; only while it waits. For organizers only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verify_tries: Option<i64>,
    /// Why the last try gave no verdict; for organizers only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verify_problem: Option<String>,
    server_version: String,
    build_hash: String,
    /// Other teams' runs with the same movements over a long stretch; for organizers only, left out if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub similar: Option<Vec<SimilarRun>>,
    /// Events of the referee.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub events: Option<Vec<Event>>,
}

from_row!(RunRecord {
    run_id, session_id, team, task, hand, mode, sensing, status, reason, note, score, in_goal, outside, ticks,
    sim_time_s, missed_ticks, state_hash, seed, seed_hex, k, started_unix_ms: "started_at",
    ended_unix_ms: "ended_at", replay_sha256, verify_note, verified_unix_ms: "verified_at", verify_problem, server_version, build_hash;
    row => similar: None, events: Some(events(row.try_get("events")?)?), verify_state: Waiting::of(row)?.map(|waiting| waiting.state),
    verify_host: Waiting::of(row)?.and_then(|waiting| waiting.host), verify_tries: Waiting::of(row)?.map(|waiting| waiting.tries),
    verify_since_unix_ms: Waiting::of(row)?.and_then(|waiting| waiting.since)
});

impl RunRecord {
    /// Whether the run is over and its replay is kept.
    pub fn has_replay(&self) -> bool {
        self.status != "open" && self.replay_sha256.is_some()
    }
}

/// A run that waits for its verification.
struct Waiting {
    state: &'static str,
    since: Option<i64>,
    host: Option<String>,
    tries: i64,
}

impl Waiting {
    fn of(row: &AnyRow) -> Result<Option<Self>, sqlx::Error> {
        let (status, ordered): (String, Option<i64>) = (row.try_get("status")?, row.try_get("verify_since")?);
        let (sha256, owner): (Option<String>, Option<String>) =
            (row.try_get("replay_sha256")?, row.try_get("verify_owner")?);
        let (ended, tries): (Option<i64>, i64) = (row.try_get("ended_at")?, row.try_get("verify_tries")?);
        let waits = match status.as_str() {
            "provisional" => true,
            "verified" | "rejected" => ordered.is_some(),
            _ => false,
        };
        let engine: Option<String> = row.try_get("engine")?;
        let stuck = owner.is_none() && tries >= STUCK_TRIES
            || engine.is_some_and(|engine| engine != identity::engine());
        let state = if stuck { "stuck" } else { "waiting" };
        // A process of a fleet has its host before a slash.
        let host = owner.and_then(|owner| Some(owner.split_once('/')?.0.to_owned()));
        Ok((waits && sha256.is_some()).then(|| Waiting { state, since: ordered.or(ended), host, tries }))
    }
}

/// Decodes the stored events.
fn events(json: Option<String>) -> Result<Vec<Event>, sqlx::Error> {
    let events = json.map(|json| serde_json::from_str(&json)).transpose();
    let events =
        events.map_err(|error| sqlx::Error::ColumnDecode { index: "events".into(), source: error.into() })?;
    Ok(events.unwrap_or_default())
}

/// The string that serde writes for a value without fields.
fn word<T: Serialize>(value: &T) -> Option<String> {
    serde_json::to_value(value).ok()?.as_str().map(str::to_owned)
}

impl Store {
    /// Whether any team began an official run.
    pub async fn has_official_runs(&self) -> Result<bool, StoreError> {
        let query = sqlx::query("SELECT 1 FROM runs WHERE k IS NOT NULL LIMIT 1");
        Ok(query.fetch_optional(&self.pool()).await?.is_some())
    }

    /// The number of the team's next run of a task, from 1. Numbers are unique.
    pub async fn next_k(&self, team: &str, task: &str) -> Result<u64, StoreError> {
        let k: Vec<i64> = sqlx::query_scalar(
            "INSERT INTO run_counters (team, task, k) VALUES ($1, $2, 1) \
             ON CONFLICT (team, task) DO UPDATE SET k = run_counters.k + 1 RETURNING k",
        )
        .bind(team)
        .bind(task)
        .fetch_all(&self.pool())
        .await?;
        Ok(k.first().ok_or(sqlx::Error::RowNotFound)?.unsigned_abs())
    }

    /// Returns the last number, with which no run was opened: the next run gets it.
    pub async fn give_back_k(&self, team: &str, task: &str, k: u64) -> Result<(), StoreError> {
        sqlx::query(
            "UPDATE run_counters SET k = k - 1 WHERE team = $1 AND task = $2 AND k = $3 AND NOT EXISTS \
             (SELECT 1 FROM runs WHERE runs.team = $1 AND runs.task = $2 AND runs.k = $3)",
        )
        .bind(team)
        .bind(task)
        .bind(signed(k))
        .execute(&self.pool())
        .await?;
        Ok(())
    }

    /// Stores a new run as open.
    pub async fn begin_run(&self, held: &Held, run: &NewRun) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        sqlx::query(
            "INSERT INTO runs (run_id, session_id, team, task, hand, mode, sensing, seed_hex, seed, \
             server_version, build_hash, started_at, status, k, hand_sha256, engine, header) \
             VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, 'open', $13, $14, $15, $16)",
        )
        .bind(&run.run_id)
        .bind(&held.session_id)
        .bind(&run.team)
        .bind(&run.task)
        .bind(&run.hand)
        .bind(run.mode)
        .bind(word(&run.sensing))
        .bind(&run.seed_hex)
        .bind(run.seed.map(signed))
        .bind(&run.server_version)
        .bind(&run.build_hash)
        .bind(unix_ms())
        .bind(run.k.map(signed))
        .bind(&run.hand_sha256)
        .bind(identity::engine())
        .bind(&run.header)
        .execute(&mut *transaction)
        .await?;
        Ok(transaction.commit().await?)
    }

    /// Stores the end of a run. Returns its status, which is void in a voided session. The result is on the disk when this returns; a
    /// second call changes nothing.
    pub async fn finish_run(&self, run: &FinishedRunRow<'_>) -> Result<String, StoreError> {
        let outcome = run.outcome;
        let events =
            serde_json::to_string(&outcome.events).map_err(|error| sqlx::Error::Encode(error.into()))?;
        let mut transaction = self.fenced(run.held).await?;
        let (replay_path, replay_sha256) = run.replay.unzip();
        // SQLite has one writer anyway.
        if self.dialect == Dialect::Postgres {
            let lock = sqlx::query("SELECT pg_advisory_xact_lock($1)").bind(NUMBERING_KEY);
            lock.execute(&mut *transaction).await?;
        }
        sqlx::query(
            "UPDATE runs SET status = CASE WHEN EXISTS (SELECT 1 FROM sessions WHERE sessions.session_id = \
             runs.session_id AND sessions.status = 'voided') THEN 'voided' ELSE $1 END, reason = $2, note = $3, \
             ticks = $4, sim_time_s = $5, score = $6, in_goal = $7, outside = $8, state_hash = $9, events = $10, \
             ended_at = $11, missed_ticks = $12, replay_path = $13, replay_sha256 = $14, \
             replay_host = $15, ended_seq = (SELECT COALESCE(MAX(ended_seq), 0) + 1 FROM runs WHERE ended_seq IS NOT NULL) \
             WHERE run_id = $16 AND status = 'open'",
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
        .bind(run.ended_unix_ms.unwrap_or_else(unix_ms))
        .bind(signed(run.missed_ticks))
        .bind(replay_path)
        .bind(replay_sha256)
        .bind(self.host_name())
        .bind(run.run_id)
        .execute(&mut *transaction)
        .await?;
        let (wall_s, simulated_s) = run.cost_s;
        // Of a run that is void already the time is given back now.
        for (cost, status) in [("taken", "NOT IN ('open', 'voided')"), ("refunded", "= 'voided'")] {
            sqlx::query(AssertSqlSafe(format!(
                "UPDATE runs SET {cost}_wall_s = $1, {cost}_simulated_s = $2 WHERE run_id = $3 AND status {status}"
            )))
            .bind(wall_s)
            .bind(simulated_s)
            .bind(run.run_id.to_owned())
            .execute(&mut *transaction)
            .await?;
        }
        if let Some(clock) = &run.clock {
            // In the transaction of the result: a run that counts always costs its time.
            write_clock(&mut transaction, &run.held.session_id, clock).await?;
        }
        let status = sqlx::query_scalar("SELECT status FROM runs WHERE run_id = $1")
            .bind(run.run_id)
            .fetch_one(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(status)
    }

    /// The run of that id.
    pub async fn run(&self, run_id: &str) -> Result<Option<RunRecord>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM runs WHERE run_id = $1").bind(run_id);
        let mut run: Option<RunRecord> = query.fetch_optional(&self.pool()).await?;
        if let Some(run) = &mut run {
            run.similar = self.similar_runs(Some(&[run_id])).await?.remove(run_id);
        }
        Ok(run)
    }

    /// All runs, oldest first, for the export.
    pub async fn runs(&self) -> Result<Vec<RunRecord>, StoreError> {
        let query = sqlx::query_as("SELECT * FROM runs ORDER BY started_at, run_id");
        let mut runs: Vec<RunRecord> = query.fetch_all(&self.pool()).await?;
        let mut similar = self.similar_runs(None).await?;
        for run in &mut runs {
            run.similar = similar.remove(&run.run_id);
        }
        Ok(runs)
    }

    /// The open run of a session that this process has taken over, if this engine can continue it.
    pub async fn interrupted_run(&self, held: &Held) -> Result<Option<InterruptedRun>, StoreError> {
        let query = sqlx::query_as(
            "SELECT run_id, header, run_wall_s, run_refunded_s FROM runs JOIN sessions \
             ON sessions.session_id = runs.session_id WHERE runs.session_id = $1 AND sessions.epoch = $2 \
             AND runs.status = 'open' AND header IS NOT NULL AND engine = $3 ORDER BY started_at DESC LIMIT 1",
        );
        let query = query.bind(held.session_id.clone()).bind(held.epoch).bind(identity::engine());
        Ok(query.fetch_optional(&self.pool()).await?)
    }

    /// Counts that another host continues a run.
    pub async fn count_move(&self, held: &Held, run_id: &str) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        sqlx::query("UPDATE runs SET moved = moved + 1 WHERE run_id = $1")
            .bind(run_id)
            .execute(&mut *transaction)
            .await?;
        Ok(transaction.commit().await?)
    }

    /// Marks the open runs of a session as aborted, or as void if the session is: their owner is gone, and they cannot continue. Returns
    /// them.
    pub async fn abort_open_runs(&self, held: &Held) -> Result<Vec<String>, StoreError> {
        let mut transaction = self.fenced(held).await?;
        let runs = sqlx::query_scalar(
            "UPDATE runs SET status = CASE (SELECT status FROM sessions WHERE session_id = $2) WHEN 'voided' \
             THEN 'voided' ELSE 'aborted' END, note = 'interrupted: the server stopped', ended_at = $1 \
             WHERE status = 'open' AND session_id = $2 RETURNING run_id",
        )
        .bind(unix_ms())
        .bind(held.session_id.clone())
        .fetch_all(&mut *transaction)
        .await?;
        transaction.commit().await?;
        Ok(runs)
    }
}
