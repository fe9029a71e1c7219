//! A run that another host has begun, continued here: the same world, bit for bit, at its last stored tick.
//!
//! World and clock stand until the client is back, or until the grace period of a lost connection has passed: the loss of the host is
//! no fault of the team.

use super::after_run::AfterRun;
use super::clock_rows;
use super::machine::{Machine, Playing};
use super::open_run::{LockstepRun, OpenRun, PlayedWorld, Stage, Stream};
use super::run_inputs;
use super::session::{Session, SessionIds, Sessions};
use crate::fleet::continued_run::{ContinueError, ContinuedRun};
use crate::watch::messages::WatchRun;
use palmares_protocol::{Code, Mode, Refusal};
use palmares_replay::{Header, Pacing};
use palmares_store::{Held, InterruptedRun, ResumableSession, StoreError};
use palmares_worlds::clock::{ClockState, Spent};
use palmares_worlds::compute::background::JobError;
use palmares_worlds::compute::open_worlds::WorldRequest;
use palmares_worlds::world::RunObserver;
use palmares_worlds::world::realtime::RealtimeWorld;
use std::sync::Arc;

/// Reason why a run was not continued.
#[derive(Debug, thiserror::Error)]
pub(super) enum NotContinued {
    /// Another attempt, here or on another host, may succeed.
    #[error("{0}")]
    Now(String),
    /// The run is void.
    #[error("{0}")]
    Ever(String),
}

impl From<StoreError> for NotContinued {
    fn from(error: StoreError) -> Self {
        NotContinued::Now(error.to_string())
    }
}

impl From<ContinueError> for NotContinued {
    fn from(error: ContinueError) -> Self {
        match error {
            ContinueError::Job(error @ JobError::Thread(_)) => NotContinued::Now(error.to_string()),
            error => NotContinued::Ever(error.to_string()),
        }
    }
}

/// A hand that is not there, or a database that did not answer.
fn hand_missing(refusal: Refusal) -> NotContinued {
    let why = format!("its hand: {}", refusal.message);
    if refusal.code == Code::Internal { NotContinued::Now(why) } else { NotContinued::Ever(why) }
}

impl Sessions {
    /// A session with its open run, which stands at its last stored tick.
    ///
    /// # Errors
    /// Reason why the run was not continued.
    pub(super) async fn continued(
        self: &Arc<Self>,
        row: &ResumableSession,
        held: &Held,
        run: InterruptedRun,
    ) -> Result<Box<Session>, NotContinued> {
        let never = |why: &str| NotContinued::Ever(why.to_owned());
        let shipper = self.shipper.as_ref().ok_or_else(|| never("this server is in no fleet"))?;
        let archive = self.archive.as_ref().ok_or_else(|| never("this server records nothing"))?;
        let header = Header::from_json(&run.header);
        let header = header.map_err(|error| NotContinued::Ever(format!("its header: {error}")))?;
        let task = self.competition.task(&header.task).ok_or_else(|| never("its task is not played here"))?;
        let task = task.clone();
        let found = run_inputs::hand(self, &row.team, &header.hand).await;
        let (hand, hand_sha256) = found.map_err(hand_missing)?;
        let provided = run_inputs::provide(self, &hand, hand_sha256.as_deref()).await;
        provided.map_err(hand_missing)?;
        let mode = match header.pacing {
            Pacing::Lockstep => Mode::Lockstep,
            Pacing::Realtime => Mode::Realtime,
        };
        let watch_run = WatchRun {
            run_id: run.run_id.clone(),
            session_id: held.session_id.clone(),
            team: row.team.clone(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            official: true,
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        let (recorder, recording) = archive.record(header.clone());
        let (shipped_to, gate) = shipper.follow(&run.run_id, held);
        let publisher = self.hub.publisher(watch_run, header.sensing, hand_sha256.is_some());
        let observers: Vec<Box<dyn RunObserver>> = vec![Box::new(publisher), Box::new(shipped_to)];
        let shipped = self.store.shipped_run(&run.run_id).await?;
        let continued =
            ContinuedRun { header: header.clone(), task: task.clone(), hand: hand.clone(), shipped };
        let request = WorldRequest { session_id: &held.session_id, mode, official: true };
        let admitted = self.compute.admit_continued(request);
        let opened = continued.open(admitted, &self.compute.background, Some(recorder), observers).await?;
        let tick = opened.observation.tick;
        let playing = Playing {
            run_id: run.run_id.clone(),
            task: task.name.clone(),
            task_hash: task.content_hash().to_owned(),
            hand: hand.name.clone(),
            hand_sha256,
            seed: None,
            k: header.k,
            tick_s: task.tick_s,
            mode,
            tick,
        };
        let before = clock_rows::state(&row.clock);
        let reset_s = self.competition.rules.reset_cost_s;
        // The clock as saved last in the run; its simulated time is that of the last stored tick.
        let in_run = ClockState {
            started: true,
            spent: Spent {
                wall_s: run.wall_s.unwrap_or(before.spent.wall_s + reset_s),
                simulated_s: before.spent.simulated_s + reset_s + tick as f64 * task.tick_s,
            },
            refunded_s: run.refunded_s.unwrap_or(before.refunded_s),
        };
        let now = self.lifecycle.now();
        let machine = Machine::continued(row.limit_s, before, &in_run, playing, now);
        self.store.count_move(held, &run.run_id).await?;
        held.set_paused(row.paused);
        // After this nothing fails: the registry has the session as long as it exists.
        let inbox = self.registry.insert(&row.token_hash, held);
        let inbox = inbox.ok_or_else(|| NotContinued::Now("the session is open here".into()))?;
        let ids = SessionIds {
            held: held.clone(),
            // The client has the token.
            resume_token: String::new(),
            token_hash: row.token_hash.clone(),
            team: row.team.clone(),
        };
        let mut session = Session::new(self, ids, true, machine, inbox);
        session.standing = Some(row.paused);
        let gate = Some(gate);
        let world = match mode {
            Mode::Lockstep => PlayedWorld::Lockstep(LockstepRun::new(opened.world, true)),
            Mode::Realtime => {
                let gate = gate.clone();
                let live =
                    RealtimeWorld::standing(opened.world, hand, task.tick_s, true, gate, &self.compute);
                session.stream = Some(Stream { live: live.clone(), went_back: true });
                PlayedWorld::Realtime(live)
            }
        };
        session.open_run = Some(OpenRun { stage: Stage::Played(world, Some(recording)), gate });
        session.show_clock();
        tracing::warn!(
            session = held.session_id,
            run = run.run_id,
            tick,
            "the run of another host continues here when its client is back"
        );
        Ok(session)
    }
}

impl Session {
    /// Drops the open run, and stores no more ticks of it.
    pub(super) fn forget_run(&mut self, after: AfterRun) {
        let gate = self.open_run.take().and_then(|run| run.gate);
        if let (Some(_), Some(run)) = (gate, self.machine.playing()) {
            self.forget_ticks(&run.run_id, after);
        }
    }

    /// Stores no more ticks of a run.
    pub(super) fn forget_ticks(&self, run_id: &str, after: AfterRun) {
        let (sessions, held, run_id) = (self.shared.clone(), self.held.clone(), run_id.to_owned());
        // It waits for a statement in progress; nobody waits for this.
        tokio::spawn(async move {
            if let Some(shipper) = &sessions.shipper {
                if after == AfterRun::Complete {
                    let _ = shipper.all_stored(&run_id).await;
                }
                shipper.forget(&run_id, &held).await;
            }
            if after == AfterRun::Delete
                && let Err(error) = sessions.store.delete_shipped_run(&run_id).await
            {
                tracing::warn!(%error, run = run_id, "the stored ticks of a finished run were not deleted");
            }
        });
    }

    /// Lets a continued run go on: its client is back, or has been away for too long.
    pub(super) async fn go_on(&mut self) {
        let Some(paused) = self.standing.take() else { return };
        if paused {
            return;
        }
        self.machine.resume(self.now());
        self.follow_clock().await;
    }
}
