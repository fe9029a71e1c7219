//! The referee: a pure state machine from poses of the objects to events, counts and points. Each kind of rules has one
//! (`task/rules/`).

mod count;
mod run_start;
mod shake;
mod snapshot;
pub(crate) mod space;
mod status;

pub use count::Count;
pub(crate) use run_start::RunStart;
pub use shake::Shake;
pub use snapshot::ObjectSnapshot;
pub use status::{Measured, ObjectStatus};

use crate::observation::Event;

/// Watches the objects of a run, in scene order, by the rules of its task.
pub trait Referee {
    /// Updates the state by every object at a tick; returns the events. Ticks ascend.
    fn watch(&mut self, tick: u64, objects: &[ObjectSnapshot]) -> Vec<Event>;

    /// The present count.
    fn count(&self) -> Count;

    /// The present points.
    fn score(&self) -> f64;

    /// Whether nothing more can be gained.
    fn complete(&self) -> bool;

    /// For each object at a tick, the conditions that decide whether it counts; `speeds` in m/s.
    fn explain(&self, tick: u64, objects: &[ObjectSnapshot], speeds: &[f64]) -> Vec<ObjectStatus>;

    /// Final count and points, after settling.
    fn final_result(&self, _objects: &[ObjectSnapshot]) -> (Count, f64) {
        (self.count(), self.score())
    }

    /// The shake of the hand's base, with the seconds since it began; None outside of one.
    fn shaking(&self, _tick: u64) -> Option<(f64, Shake)> {
        None
    }
}

/// A referee whose state a snapshot holds.
pub(crate) trait Stateful {
    /// Everything that changes in a run.
    type State: Clone;

    /// The present state.
    fn state(&self) -> &Self::State;

    /// The present state, to be replaced.
    fn state_mut(&mut self) -> &mut Self::State;

    /// Whether a state has the numbers of objects and goals of this referee.
    fn fits(&self, _: &Self::State) -> bool {
        true
    }
}
