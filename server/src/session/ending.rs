//! How a run ends: whoever ends it, its result is stored before anybody hears of it.

use super::driver::{Finished, Session, Stage, store_failed};
use super::machine::{Playing, Stopping};
use crate::protocol::reply::{ReplayInfo, RunResult};
use crate::protocol::{Code, Refusal, Reply};
use crate::store::{FinishedRun, NewAuditEntry};
use crate::world::live::Course;
use crate::world::playable::Fault;
use palmares_tasks::{Outcome, Reason};
use tokio::task::spawn_blocking;

impl Session {
    /// Closes the run and tells its result, or tells the result of a run the server closed.
    pub(crate) async fn stop(&mut self, id: u64) -> Result<Reply, Refusal> {
        self.close_if_over().await;
        let mut result = match self.machine.stop()? {
            Stopping::Waiting(result) => result,
            Stopping::Open => Box::new(self.finish(Reason::Stopped, None).await?),
        };
        // What was not taken until now is of no use any more.
        self.stream = None;
        result.id = Some(id);
        result.session_left_s = self.left_s();
        Ok(Reply::Result(result))
    }

    pub(super) async fn close_if_over(&mut self) -> bool {
        self.catch_up();
        let over = self.machine.playing().is_some() && self.machine.clock().is_over(self.host.now());
        if over {
            self.close_run(Reason::SessionOver, None).await;
        }
        over
    }

    /// Finishes the open run; its result waits for `stop`. If it cannot be stored, `stop` tries again.
    pub(super) async fn close_run(&mut self, reason: Reason, note: Option<&str>) {
        if let Ok(result) = self.finish(reason, note).await {
            self.machine.closed(result);
        }
    }

    /// Finishes the open run and stores its result before anybody hears of it.
    pub(super) async fn finish(&mut self, reason: Reason, note: Option<&str>) -> Result<RunResult, Refusal> {
        if self.unstored.is_none() {
            self.catch_up();
            let Some(run) = self.machine.playing().cloned() else {
                return Err(Refusal::new(Code::WrongState, "no run is open; send reset first"));
            };
            let (world, course) = match std::mem::take(&mut self.stage) {
                Stage::Empty => (None, Course::default()),
                Stage::Lockstep(world) => (Some(*world), Course::default()),
                Stage::Realtime(live) => {
                    let by_us = matches!(reason, Reason::SessionOver | Reason::Voided);
                    // A tick that is being made may take long: not on a thread that others need.
                    let taken = move || (live.take(by_us.then_some(reason)), live.course());
                    spawn_blocking(taken).await.unwrap_or_default()
                }
            };
            let outcome = match world {
                // An unsound world has nothing to say.
                Some(world) if reason == Reason::WorldFault => Err(world.fault().unwrap_or(Fault::Broken)),
                Some(world) => world.finish(&self.host.compute.background, reason).await,
                None => Err(Fault::Broken),
            };
            let mut note = note.map(str::to_owned);
            let recording = self.recording.take();
            let mut replay = None;
            let mut lost = self.official;
            if let (Some(recording), Ok(_)) = (recording, &outcome) {
                match recording.file().await {
                    Ok(file) => (replay, lost) = (file, false),
                    Err(error) => tracing::error!(error, run = run.run_id, "no replay"),
                }
            }
            let ended = self.machine.clock().spent(self.host.now());
            self.unstored = Some(match outcome {
                Ok(outcome) => {
                    let mut status = match (reason, self.official) {
                        (Reason::Voided, _) => "voided",
                        (_, true) if outcome.ticks == 0 => "aborted",
                        (_, true) => "provisional",
                        (_, false) => "practice",
                    };
                    if lost && status != "voided" {
                        // A score is listed only when it replays. That it does not is the server's fault.
                        status = "voided";
                        note = Some("the replay could not be written".into());
                    }
                    if status == "aborted" {
                        note = note.or_else(|| Some("it ended before its first tick".into()));
                    }
                    Finished { run, outcome, status, refunded: true, note, course, replay, ended }
                }
                Err(fault) => {
                    tracing::error!(run = run.run_id, tick = run.tick, ?fault, "world fault; run voided");
                    let (refunded, why) = blame(fault, run.own_hand);
                    let (status, note) = ("voided", Some(why.to_owned()));
                    Finished { outcome: nothing(&run), run, status, refunded, note, course, replay, ended }
                }
            });
        } else if let Some(finished) = &self.unstored {
            self.machine.forgive(finished.ended, self.host.now());
        }
        let Some(finished) = self.unstored.take() else {
            return Err(Refusal::new(Code::WrongState, "no run is open; send reset first"));
        };
        if let Some(file) = &finished.replay {
            let (run_id, path) = (&finished.run.run_id, file.stored_path());
            if let Err(error) = self.host.store.set_replay(run_id, &path, &file.sha256).await {
                self.unstored = Some(finished);
                return Err(store_failed("the replay", &error));
            }
        }
        let (now, refund) = (self.host.now(), finished.status == "voided" && finished.refunded);
        let (taken, after) = (self.machine.taken(now), self.machine.after(now, refund));
        let row = FinishedRun {
            run_id: &finished.run.run_id,
            status: finished.status,
            outcome: &finished.outcome,
            note: finished.note.as_deref(),
            missed_ticks: finished.course.tempo.missed,
            taken_s: (taken.wall_s, taken.simulated_s),
            clock: self.official.then(|| (self.session_id.as_str(), after.row())),
        };
        let status = match self.host.store.finish_run(&row).await {
            Ok(status) => status,
            Err(error) => {
                self.unstored = Some(finished);
                return Err(store_failed("the result", &error));
            }
        };
        self.host.watch.ranking_changed();
        let refund = refund || (status == "voided" && finished.status != "voided");
        let Finished { run, outcome, course, replay, note, .. } = finished;
        if status == "voided" && outcome.reason != Reason::Voided {
            let entry = NewAuditEntry {
                actor: "server",
                action: "run.void",
                subject: &run.run_id,
                reason: note.as_deref(),
            };
            if let Err(error) = self.host.store.record(&entry).await {
                tracing::error!(%error, run = run.run_id, "no record of a void run");
            }
        }
        if status == "aborted" {
            let entry = NewAuditEntry {
                actor: "server",
                action: "run.abort",
                subject: &run.run_id,
                reason: note.as_deref(),
            };
            if let Err(error) = self.host.store.record(&entry).await {
                tracing::error!(%error, run = run.run_id, "no record of a run without a tick");
            }
        }
        if let Some(archive) = &self.host.replays {
            archive.wake();
        }
        self.machine.ended(self.host.now(), refund);
        self.save(true).await;
        tracing::info!(
            run = run.run_id,
            score = outcome.score,
            ticks = outcome.ticks,
            missed = course.tempo.missed,
            late = course.tempo.late,
            status,
            "run closed"
        );
        let mut result = RunResult::new(run.info(), &status, outcome);
        result.replay = replay.map(|file| ReplayInfo { sha256: file.sha256, bytes: file.bytes });
        result.missed_ticks = course.tempo.missed;
        result.late_ticks = course.tempo.late;
        result.late_max_s = course.tempo.latest.as_secs_f64();
        result.dropped_obs = course.dropped;
        Ok(result)
    }
}

/// Whether the time of a run is given back whose world failed of this, and what is noted. A team could make itself time
/// with a hand that breaks the physics, or with actions that no tick has time for.
fn blame(fault: Fault, own_hand: bool) -> (bool, &'static str) {
    match (fault, own_hand) {
        (Fault::Exhausted, _) => (
            false,
            "the world failed: a tick asked for more work than a tick may; its time is not given back",
        ),
        (Fault::Broken, true) => {
            (false, "the world failed with a hand of the team's own; its time is not given back")
        }
        (Fault::Broken, false) => (true, "the world failed"),
    }
}

/// The outcome of a run whose world failed: nothing counts.
fn nothing(run: &Playing) -> Outcome {
    Outcome {
        score: 0.0,
        in_goal: 0,
        outside: 0,
        reason: Reason::WorldFault,
        ticks: run.tick,
        sim_time_s: run.tick as f64 * run.tick_s,
        events: Vec::new(),
        state_hash: "0".repeat(16),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_team_wins_no_time_by_breaking_its_own_world() {
        for (fault, own_hand, refunded) in [
            (Fault::Broken, false, true),
            (Fault::Broken, true, false),
            (Fault::Exhausted, false, false),
            (Fault::Exhausted, true, false),
        ] {
            let (given_back, why) = blame(fault, own_hand);
            assert_eq!(given_back, refunded, "{fault:?}, {own_hand}");
            assert_eq!(why.contains("not given back"), !refunded, "{why}");
        }
    }
}
