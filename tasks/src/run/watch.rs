//! Observers of the steps of a tick.

use palmares_sim::{PhaseTimer, World};

/// Observer of every step, and of the ends of its phases.
pub trait StepWatch: PhaseTimer {
    /// The world has taken a step.
    fn stepped(&mut self, world: &World);
}

impl StepWatch for () {
    fn stepped(&mut self, _: &World) {}
}
