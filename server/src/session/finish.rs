//! The end of a run: its result is stored before it is sent.
//!
//! The world is closed, the replay completed, the status decided. Then the result is stored, the clock accounts for the run, and
//! the result is sent. A result that could not be stored is kept, and `stop` tries again.

use super::after_run::AfterRun;
use super::clock_rows;
use super::failure::store_failed;
use super::finished::{Decision, FinishedRun, RunEnd, RunStatus};
use super::machine::{Playing, Stopping};
use super::open_run::{OpenRun, PlayedWorld, Stage};
use super::session::{RETRY, Session};
use crate::archive::{Recording, stored_path};
use palmares_protocol::reply::{ReplayInfo, RunResult};
use palmares_protocol::{Code, Refusal, Reply};
use palmares_replay::ReplayFile;
use palmares_store::{FinishedRunRow, NewAuditEntry};
use palmares_tasks::run::Failure;
use palmares_tasks::{Fault, Outcome, Reason};
use palmares_worlds::world::realtime::RealtimeStats;
use std::time::Duration;
use tokio::task::spawn_blocking;

/// Longest wait for the statement with the last ticks; they are stored later if the database does not answer.
const LAST_TICKS: Duration = Duration::from_secs(1);

/// A run's end as stored.
struct StoredEnd {
    /// Its status: void if its session is void.
    status: String,
    /// Whether its time is given back.
    refund: bool,
}

/// The replay is missing.
struct ReplayLost;

impl Session {
    /// Closes the run and returns its result, or returns the result of a run that the server has closed.
    pub(super) async fn stop(&mut self, id: u64) -> Result<Reply, Refusal> {
        let mut result = match self.machine.stop()? {
            Stopping::Waiting(result) => result,
            Stopping::Open => Box::new(self.finish(Reason::Stopped, None).await?),
        };
        // Observations that are still in the stream are dropped.
        self.stream = None;
        result.id = Some(id);
        result.session_left_s = self.left_s();
        Ok(Reply::Result(result))
    }

    /// Finishes the open run; its result waits for `stop`. If it could not be stored, `stop` tries again.
    pub(super) async fn close_run(&mut self, reason: Reason, note: Option<&str>) {
        if let Ok(result) = self.finish(reason, note).await {
            self.machine.closed(result);
        }
    }

    /// Finishes the open run, stores its result, then returns it.
    pub(super) async fn finish(&mut self, reason: Reason, note: Option<&str>) -> Result<RunResult, Refusal> {
        self.catch_up();
        let finished = match self.open_run.as_mut().map(OpenRun::close) {
            Some(Stage::Unstored(finished, _)) => finished,
            Some(Stage::Played(world, recording)) => {
                Box::new(self.close(Some(world), recording, reason, note).await?)
            }
            Some(Stage::Closing) | None => Box::new(self.close(None, None, reason, note).await?),
        };
        let before = self.machine.clock().spent(self.now());
        let stored = match self.store(&finished).await {
            Ok(stored) => stored,
            Err(refusal) => {
                // The attempt costs nothing. The time until the next request is the team's.
                self.machine.refund_since(before, self.now());
                self.show_clock();
                let try_again_at = self.now() + RETRY;
                if let Some(run) = &mut self.open_run {
                    run.stage = Stage::Unstored(finished, try_again_at);
                }
                return Err(refusal);
            }
        };
        self.shared.hub.ranking_changed();
        self.record_in_audit(&finished, &stored).await;
        if let Some(archive) = &self.shared.archive {
            archive.wake();
        }
        self.forget_run(AfterRun::of(finished.replay.is_some()));
        self.machine.ended(self.now(), stored.refund);
        self.save(true).await;
        Ok(result(*finished, &stored))
    }

    /// Closes the world of the open run and decides on the run's status. The world is missing if this was interrupted before.
    async fn close(
        &mut self,
        world: Option<PlayedWorld>,
        recording: Option<Recording>,
        reason: Reason,
        note: Option<&str>,
    ) -> Result<FinishedRun, Refusal> {
        let Some(run) = self.machine.playing().cloned() else {
            return Err(Refusal::new(Code::WrongState, "no run is open; send reset first"));
        };
        let (outcome, stats) = self.close_world(world, reason).await;
        let sessions = self.shared.clone();
        let last_ticks = async {
            // Without its last ticks the replay cannot be written again if this host is lost before the upload.
            if let Some(shipper) = &sessions.shipper {
                let _ = tokio::time::timeout(LAST_TICKS, shipper.all_stored(&run.run_id)).await;
            }
        };
        let (replay, ()) = tokio::join!(keep_replay(recording, &run, &outcome), last_ticks);
        let end = RunEnd {
            reason,
            official: self.official,
            ticks: outcome.as_ref().map(|outcome| outcome.ticks).map_err(|failure| *failure),
            replay_lost: replay.is_err(),
            own_hand: run.hand_sha256.is_some(),
        };
        let decision = Decision::on(end, note);
        let outcome = outcome.unwrap_or_else(|failure| {
            log(&self.held.session_id, &run, &failure);
            nothing(&run, failure.fault)
        });
        Ok(FinishedRun { run, outcome, decision, stats, replay: replay.unwrap_or(None) })
    }

    /// Lets the world settle and scores the run.
    async fn close_world(
        &mut self,
        world: Option<PlayedWorld>,
        reason: Reason,
    ) -> (Result<Outcome, Failure>, RealtimeStats) {
        let tick = self.machine.playing().map_or(0, |run| run.tick);
        let lost = Failure { fault: Fault::Crashed, tick, step: None };
        let (world, stats) = match world {
            None => (None, RealtimeStats::default()),
            Some(PlayedWorld::Lockstep(run)) => (Some(run.world), RealtimeStats::default()),
            Some(PlayedWorld::Realtime(live)) => {
                let by_us = matches!(reason, Reason::SessionOver | Reason::Voided);
                // Blocks while a tick is in progress.
                let taken = move || (live.take(by_us.then_some(reason)), live.stats());
                spawn_blocking(taken).await.unwrap_or_default()
            }
        };
        let outcome = match world {
            // A failed world has no outcome.
            Some(world) if reason == Reason::WorldFault => Err(world.failure().unwrap_or(lost)),
            Some(world) => world.finish(&self.shared.compute.background, reason).await,
            None => Err(lost),
        };
        (outcome, stats)
    }

    /// Stores the result, the replay's digest and the clock.
    async fn store(&mut self, finished: &FinishedRun) -> Result<StoredEnd, Refusal> {
        let FinishedRun { run, outcome, decision, stats, replay, .. } = finished;
        let (shared, held) = (self.shared.clone(), self.held.clone());
        let path = replay.as_ref().map(stored_path);
        let sha256 = replay.as_ref().map(|file| file.sha256.as_str());
        let ended_unix_ms = replay.as_ref().and_then(|file| i64::try_from(file.ended_unix_ms).ok());
        let (now, refund) = (self.now(), decision.refunds());
        let (cost, after) = (self.machine.run_cost(now), self.machine.after(now, refund));
        let row = FinishedRunRow {
            held: &held,
            run_id: &run.run_id,
            status: decision.status.word(),
            outcome,
            note: decision.note.as_deref(),
            missed_ticks: stats.tempo.missed,
            cost_s: (cost.wall_s, cost.simulated_s),
            clock: self.official.then(|| clock_rows::row(after)),
            replay: path.as_deref().zip(sha256),
            ended_unix_ms,
        };
        let status = self.stored(shared.store.finish_run(&row)).await.map_err(store_failed("the result"))?;
        let by_session = status == "voided" && !matches!(decision.status, RunStatus::Voided { .. });
        Ok(StoredEnd { status, refund: refund || by_session })
    }

    /// Records runs that count for nothing without an organizer's command.
    async fn record_in_audit(&mut self, finished: &FinishedRun, stored: &StoredEnd) {
        let (action, what) = match stored.status.as_str() {
            "voided" if finished.outcome.reason != Reason::Voided => ("run.void", "a void run"),
            "aborted" => ("run.abort", "a run without a tick"),
            _ => return,
        };
        let (subject, reason) = (finished.run.run_id.as_str(), finished.decision.note.as_deref());
        let entry = NewAuditEntry { actor: "server", action, subject, reason };
        let shared = self.shared.clone();
        if let Err(error) = self.stored(shared.store.record(&entry)).await {
            tracing::error!(%error, run = subject, "{what} is not in the audit");
        }
    }
}

/// Waits for the replay of a scored run. A run without a tick has none, which is no loss.
async fn keep_replay(
    recording: Option<Recording>,
    run: &Playing,
    outcome: &Result<Outcome, Failure>,
) -> Result<Option<ReplayFile>, ReplayLost> {
    let (Some(recording), Ok(_)) = (recording, outcome) else { return Err(ReplayLost) };
    recording.file().await.map_err(|error| {
        tracing::error!(error, run = run.run_id, "no replay");
        ReplayLost
    })
}

/// The result for the client.
fn result(finished: FinishedRun, stored: &StoredEnd) -> RunResult {
    let FinishedRun { run, outcome, decision, stats, replay, .. } = finished;
    tracing::info!(
        run = run.run_id,
        score = outcome.score,
        ticks = outcome.ticks,
        missed = stats.tempo.missed,
        late = stats.tempo.late,
        status = stored.status,
        "run closed"
    );
    let mut result = RunResult::new(run.info(), &run.task_hash, &stored.status, outcome);
    result.note = decision.note.filter(|_| result.fault.is_some());
    result.replay = replay.map(|file| ReplayInfo { sha256: file.sha256, bytes: file.bytes });
    result.missed_ticks = stats.tempo.missed;
    result.late_ticks = stats.tempo.late;
    result.late_max_s = stats.tempo.latest.as_secs_f64();
    result.dropped_obs = stats.dropped;
    result
}

/// Logs the inputs that reproduce the failure: `palmares.sim.World` with this task, hand and seed, and the team's actions.
fn log(session: &str, run: &Playing, failure: &Failure) {
    let Failure { fault, tick, step } = failure;
    tracing::error!(
        session,
        run = run.run_id,
        fault = fault.code(),
        tick,
        step,
        task = run.task,
        hand = run.hand,
        hand_sha256 = run.hand_sha256,
        seed = run.seed,
        k = run.k,
        why = fault.in_words(),
        "world fault; run voided"
    );
}

/// The outcome of a run whose world has failed: nothing counts.
fn nothing(run: &Playing, fault: Fault) -> Outcome {
    Outcome {
        score: 0.0,
        in_goal: 0,
        outside: 0,
        reason: Reason::WorldFault,
        fault: Some(fault),
        ticks: run.tick,
        sim_time_s: run.tick as f64 * run.tick_s,
        events: Vec::new(),
        state_hash: "0".repeat(16),
    }
}
