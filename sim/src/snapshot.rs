//! Snapshot of a world between two steps.

use crate::bounds::Fault;
use crate::model::Model;
use crate::outcome::StepOutcome;
use crate::state::State;
use crate::step::StepForces;
use crate::world::World;
use serde::{Deserialize, Serialize};

/// The state of a world, and the results of its last step. A world of the same model that is restored from it
/// continues, and is observed, as the original, bit for bit.
#[derive(Clone, Serialize, Deserialize)]
pub struct Snapshot {
    state: State,
    forces: StepForces,
    outcome: StepOutcome,
    fault: Option<Fault>,
}

impl Snapshot {
    /// The state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Whether it fits a world of this model: every list has the model's length, every index is within them,
    /// and every number is within its bounds, except in a world with a fault, which does not move. Decoded
    /// bytes may hold anything.
    pub fn fits(&self, model: &Model) -> bool {
        self.state.fits(model) && self.forces.fits(model) && (self.fault.is_some() || self.state.is_bounded())
    }
}

impl World {
    /// Takes a snapshot. Not between [`World::prepare`] and the step that it prepares.
    pub fn snapshot(&self) -> Snapshot {
        let work = &self.scratch.work;
        Snapshot {
            state: self.state.clone(),
            forces: work.forces.clone(),
            outcome: work.outcome,
            fault: work.fault,
        }
    }

    /// Continues from a snapshot. Pushes for the next step are dropped.
    pub fn resume(&mut self, from: &Snapshot) {
        self.state.take_over(&from.state);
        self.discard_caches();
        let work = &mut self.scratch.work;
        work.forces.clone_from(&from.forces);
        (work.outcome, work.fault) = (from.outcome, from.fault);
        work.loads.clear();
    }

    /// Continues with its own steps from a snapshot of a world whose steps are so long, s, but which is the
    /// same otherwise. Counts of steps are converted; the first step does not use the one before.
    pub fn resume_from_steps(&mut self, from: &Snapshot, step_s: f64) {
        self.resume(from);
        let share = step_s / self.model().config().step_s;
        self.state.earlier.smooth = false;
        self.state.substeps = 0;
        for sleep in &mut self.state.sleep {
            sleep.still_steps = (f64::from(sleep.still_steps) * share) as u32;
        }
    }
}
