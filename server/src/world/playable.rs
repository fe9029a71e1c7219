//! What a world needs of a run, and what it fails of.

use palmares_tasks::{Action, ActionError, Event, Observation, Outcome, Reason, Run, Sensing};

/// What a world failed of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Numbers that are none or out of bounds, a step without a solution, or a panic.
    Broken,
    /// A tick asked for more work than a tick may: the hand or the action is of a kind that no controller needs.
    Exhausted,
}

/// What a world needs of a run. [`Run`] is the real one; tests bring worlds that break.
pub(crate) trait Playable: Send {
    fn step(&mut self, action: &Action) -> Result<(), ActionError>;
    /// Does what the next step does before its action matters.
    fn prepare(&mut self) {}
    fn observe(&self, sensing: Sensing) -> Observation;
    fn events(&self) -> &[Event];
    fn over(&self) -> Option<Reason>;
    /// Why the world is unsound, when it is.
    fn fault(&self) -> Option<Fault>;
    fn finish(&mut self, reason: Reason) -> Outcome;
    /// For witnesses and for what only a real run can do.
    fn run(&mut self) -> Option<&mut Run>;
}

impl Playable for Run {
    fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        Run::step(self, action)
    }
    fn prepare(&mut self) {
        Run::prepare(self);
    }
    fn observe(&self, sensing: Sensing) -> Observation {
        Run::observe(self, sensing)
    }
    fn events(&self) -> &[Event] {
        Run::events(self)
    }
    fn over(&self) -> Option<Reason> {
        Run::over(self)
    }
    fn fault(&self) -> Option<Fault> {
        Run::fault(self).map(|fault| match fault {
            palmares_sim::Fault::WorkExhausted => Fault::Exhausted,
            palmares_sim::Fault::NotFinite
            | palmares_sim::Fault::OutOfBounds
            | palmares_sim::Fault::Unsolvable => Fault::Broken,
        })
    }
    fn finish(&mut self, reason: Reason) -> Outcome {
        Run::finish(self, reason)
    }
    fn run(&mut self) -> Option<&mut Run> {
        Some(self)
    }
}
