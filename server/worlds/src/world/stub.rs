//! A run without physics, for tests: it counts ticks, and ends, breaks, panics or never returns at a given tick.

use super::run::{Playable, World};
use crate::compute::admission::Admission;
use crate::compute::open_worlds::WorldRequest;
use palmares_protocol::Mode;
use palmares_tasks::run::Failure;
use palmares_tasks::{
    Action, ActionError, Event, Fault, HandObservation, Observation, Outcome, Reason, Run, Sensing,
};
use std::time::Instant;

/// A request for a world.
pub(super) const REQUEST: WorldRequest<'static> =
    WorldRequest { session_id: "ses", mode: Mode::Lockstep, official: false };

/// Counts ticks; ends, breaks, panics or never returns at a given tick.
pub(super) struct Stub {
    pub(super) tick: u64,
    pub(super) last_action: Action,
    pub(super) new_events: Vec<Event>,
    pub(super) over_at: u64,
    pub(super) unsound_at: u64,
    pub(super) panic_at: u64,
    /// Cause of the failure.
    pub(super) breaks: Fault,
    /// Every tick waits until the other end is dropped.
    pub(super) endless: Option<std::sync::mpsc::Receiver<()>>,
}

impl Default for Stub {
    fn default() -> Self {
        Stub {
            tick: 0,
            last_action: Action::default(),
            new_events: vec![],
            over_at: u64::MAX,
            unsound_at: u64::MAX,
            panic_at: u64::MAX,
            breaks: Fault::Unsolvable,
            endless: None,
        }
    }
}

impl Playable for Stub {
    fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        if action.hand.as_ref().is_some_and(|sigma| !sigma.is_empty()) {
            return Err(ActionError::ZeroQuaternion);
        }
        self.tick += 1;
        self.last_action = action.clone();
        if let Some(endless) = &self.endless {
            let _ = endless.recv();
        }
        assert!(self.tick != self.panic_at, "toy panic");
        self.new_events = vec![Event { tick: self.tick, kind: "tick".into(), object: None }];
        Ok(())
    }
    fn observe(&self, _: Sensing) -> Observation {
        Observation {
            tick: self.tick,
            sim_time_s: 0.0,
            applied_action: self.last_action.clone(),
            hand: HandObservation::default(),
            arm: None,
            cameras: vec![],
            truth: None,
            events: self.new_events.clone(),
            score: 0.0,
            terminated: false,
            truncated: self.tick >= self.over_at,
            reason: None,
        }
    }
    fn failure(&self) -> Option<Failure> {
        let failure = Failure { fault: self.breaks, tick: self.tick, step: Some(10 * self.tick) };
        (self.tick >= self.unsound_at).then_some(failure)
    }
    fn crash(&self) -> Failure {
        Failure { fault: Fault::Crashed, tick: self.tick, step: Some(10 * self.tick) }
    }
    fn events(&self) -> &[Event] {
        &self.new_events
    }
    fn over(&self) -> Option<Reason> {
        (self.tick >= self.over_at).then_some(Reason::TimeLimit)
    }
    fn run(&mut self) -> Option<&mut Run> {
        None
    }
    fn finish(&mut self, reason: Reason) -> Outcome {
        Outcome {
            score: self.tick as f64,
            in_goal: 0,
            outside: 0,
            reason,
            fault: None,
            ticks: self.tick,
            sim_time_s: 0.0,
            events: vec![],
            state_hash: String::new(),
        }
    }
}

/// A world with this stub, and the admission that counts it.
pub(super) fn stub_world(stub: Stub) -> (World, Admission) {
    let admission = Admission::default();
    let admitted = admission.take(REQUEST, Instant::now(), |_| Ok(())).expect("free");
    (World::of(Box::new(stub), Sensing::Truth, vec![], admitted), admission)
}
