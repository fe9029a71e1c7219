//! The referee: a pure state machine from poses of the objects to events, counts and points.

mod arrange;
mod collect;
mod count;
mod hold;
mod snapshot;
mod space;
mod status;

pub use arrange::ArrangeReferee;
use arrange::ArrangeState;
pub use collect::CollectReferee;
use collect::CollectState;
pub use count::Count;
use hold::HoldState;
pub use hold::{HoldReferee, Slip};
pub use snapshot::ObjectSnapshot;
pub use status::{Measured, ObjectStatus};

use crate::observation::Event;
use crate::task::{Rules, Task};
use serde::{Deserialize, Serialize};

/// Watches the objects of a run by the rules of its task.
#[derive(Clone, Debug)]
pub enum Referee {
    /// Objects are brought from region to region.
    Collect(CollectReferee),
    /// One object is lifted, held and shaken.
    Hold(HoldReferee),
    /// Goals are reached one after the other.
    Arrange(ArrangeReferee),
}

/// The state of a referee.
#[derive(Clone, Serialize, Deserialize)]
pub struct RefereeState(KindState);

/// The state by kind of rules.
#[derive(Clone, Serialize, Deserialize)]
enum KindState {
    /// Place of each object.
    Collect(CollectState),
    /// Stage of the object.
    Hold(HoldState),
    /// Number of goals that have been reached.
    Arrange(ArrangeState),
}

impl Referee {
    /// A referee at tick 0, with the objects at these poses.
    pub fn new(task: &Task, objects: &[ObjectSnapshot]) -> Self {
        match &task.rules {
            Rules::Collect(rules) => Referee::Collect(CollectReferee::new(task, rules, objects.len())),
            Rules::Hold(rules) => Referee::Hold(HoldReferee::new(rules, task.tick_s, objects)),
            Rules::Arrange(rules) => Referee::Arrange(ArrangeReferee::new(task, rules, objects)),
        }
    }

    /// The present state.
    pub fn state(&self) -> RefereeState {
        RefereeState(match self {
            Referee::Collect(referee) => KindState::Collect(referee.state.clone()),
            Referee::Hold(referee) => KindState::Hold(referee.state),
            Referee::Arrange(referee) => KindState::Arrange(referee.state),
        })
    }

    /// Whether a state fits this referee: the same kind of rules, with the same numbers of objects and goals.
    pub fn fits(&self, state: &RefereeState) -> bool {
        match (self, &state.0) {
            (Referee::Collect(referee), KindState::Collect(state)) => referee.fits(state),
            (Referee::Hold(_), KindState::Hold(_)) => true,
            (Referee::Arrange(referee), KindState::Arrange(state)) => referee.fits(state),
            _ => false,
        }
    }

    /// Continues from a state.
    pub fn restore(&mut self, state: &RefereeState) {
        match (self, &state.0) {
            (Referee::Collect(referee), KindState::Collect(state)) => referee.state.clone_from(state),
            (Referee::Hold(referee), KindState::Hold(state)) => referee.state = *state,
            (Referee::Arrange(referee), KindState::Arrange(state)) => referee.state = *state,
            // A state of another kind of task.
            (Referee::Collect(_) | Referee::Hold(_) | Referee::Arrange(_), _) => {}
        }
    }

    /// Updates the state by every object, in scene order; returns the events. Ticks ascend.
    pub fn watch(&mut self, tick: u64, objects: &[ObjectSnapshot]) -> Vec<Event> {
        match self {
            Referee::Collect(referee) => referee.watch(tick, objects),
            Referee::Hold(referee) => referee.watch(tick, objects),
            Referee::Arrange(referee) => referee.watch(tick, objects),
        }
    }

    /// The present count.
    pub fn count(&self) -> Count {
        match self {
            Referee::Collect(referee) => referee.count(),
            Referee::Hold(referee) => referee.count(),
            Referee::Arrange(referee) => referee.count(),
        }
    }

    /// The present points.
    pub fn score(&self) -> f64 {
        match self {
            Referee::Collect(referee) => referee.score(referee.count()),
            Referee::Hold(referee) => referee.score(),
            Referee::Arrange(referee) => referee.score(),
        }
    }

    /// Final count and points, after settling.
    pub fn final_result(&self, objects: &[ObjectSnapshot]) -> (Count, f64) {
        match self {
            Referee::Collect(referee) => {
                let count = referee.final_count(objects);
                (count, referee.score(count))
            }
            Referee::Hold(referee) => (referee.count(), referee.score()),
            Referee::Arrange(referee) => (referee.count(), referee.score()),
        }
    }

    /// For each object at a tick, the rules that decide whether it counts; `speeds` in m/s.
    pub fn explain(&self, tick: u64, objects: &[ObjectSnapshot], speeds: &[f64]) -> Vec<ObjectStatus> {
        match self {
            Referee::Collect(referee) => referee.explain(objects, speeds),
            Referee::Hold(referee) => referee.explain(tick, objects),
            Referee::Arrange(referee) => referee.explain(tick, objects, speeds),
        }
    }

    /// Whether nothing more can be gained.
    pub fn complete(&self) -> bool {
        match self {
            Referee::Collect(referee) => referee.complete(),
            Referee::Hold(referee) => referee.complete(),
            Referee::Arrange(referee) => referee.complete(),
        }
    }

    /// Seconds since the shake of the hand's base began; None outside of a shake.
    pub fn shaking(&self, tick: u64) -> Option<f64> {
        match self {
            Referee::Collect(_) | Referee::Arrange(_) => None,
            Referee::Hold(referee) => referee.shaking(tick),
        }
    }
}
