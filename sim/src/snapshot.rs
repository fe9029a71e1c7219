//! A world between two steps, to be gone back to.

use crate::bounds::Fault;
use crate::model::Model;
use crate::outcome::Outcome;
use crate::state::State;
use crate::step::StepForces;
use crate::world::World;
use serde::{Deserialize, Serialize};

/// The state of a world and what its last step told: a world given it goes on, and is observed, as the one it was taken of,
/// bit for bit. It holds for worlds of the same model.
#[derive(Clone, Serialize, Deserialize)]
pub struct Snapshot {
    state: State,
    forces: StepForces,
    outcome: Outcome,
    fault: Option<Fault>,
}

impl Snapshot {
    /// The state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Whether it can be of a world of this model: every list is as long as the model's, every index is within them, and
    /// every number within its bounds, but in a world with a fault, which stands still. What was read from bytes may be anything.
    pub fn fits(&self, model: &Model) -> bool {
        self.state.fits(model) && self.forces.fits(model) && (self.fault.is_some() || self.state.is_bounded())
    }
}

impl World {
    /// Takes one. Not between [`World::prepare`] and the step that it prepares.
    pub fn snapshot(&self) -> Snapshot {
        let work = &self.scratch.work;
        Snapshot {
            state: self.state.clone(),
            forces: work.forces.clone(),
            outcome: work.outcome,
            fault: work.fault,
        }
    }

    /// Goes on from one. Pushes that were to act in the next step are forgotten.
    pub fn resume(&mut self, from: &Snapshot) {
        self.state.take_over(&from.state);
        self.forget();
        let work = &mut self.scratch.work;
        work.forces.clone_from(&from.forces);
        (work.outcome, work.fault) = (from.outcome, from.fault);
        work.loads.clear();
    }
}
