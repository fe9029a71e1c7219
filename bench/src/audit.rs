//! An audit of the energy of free bodies.
//!
//! Kinetic and potential energy, less the work of kicks, may fall (friction, dissipation) but never rise
//! above an earlier value by more than contacts held then. The energy in contacts is bounded from above: a
//! normal force f at an overlap δ by the larger of ½ f δ and ½ k δ², since f has the damper's share in it and
//! a near-rigid contact is softer than k; friction f_t in a stiction anchor of stiffness k_t by ½ f_t²/k_t.
//! Overlaps are those at the start of a step, forces those of its end, so that a step's contacts count at its
//! start.

use crate::energy::Stored;
use crate::engine::Engine;
use anyhow::Result;
use palmares_sim::World;

/// The energy of a run.
#[derive(Clone, Copy, Debug)]
pub struct Audit {
    work_j: f64,
    kicks_j: f64,
    /// The least energy of bodies and contacts, less the work, J.
    least_j: f64,
    most_j: f64,
    gain_j: f64,
}

impl Default for Audit {
    fn default() -> Self {
        Audit { work_j: 0.0, kicks_j: 0.0, least_j: f64::INFINITY, most_j: f64::NEG_INFINITY, gain_j: 0.0 }
    }
}

/// Kinetic and potential energy of everything, J.
pub fn mechanical(engine: &dyn Engine) -> f64 {
    Stored::of(engine.model(), engine.state()).total()
}

impl Audit {
    /// Adds work from outside, J.
    pub fn worked(&mut self, work_j: f64) {
        self.work_j += work_j;
        self.kicks_j += work_j.abs();
    }

    /// Has `step` take one step of `engine`, and balances the state before it.
    pub fn step(
        &mut self,
        engine: &mut dyn Engine,
        step: impl FnOnce(&mut dyn Engine) -> Result<()>,
    ) -> Result<()> {
        let bodies = mechanical(engine) - self.work_j;
        step(engine)?;
        self.gain_j = self.gain_j.max(bodies - self.least_j);
        self.least_j = self.least_j.min(bodies + engine.world().map_or(0.0, held));
        self.most_j = self.most_j.max(bodies);
        Ok(())
    }

    /// Largest unexplained rise, J.
    pub fn gain_j(&self) -> f64 {
        self.gain_j
    }

    /// The same as a part of the energy that was available: the fall of the balance from its highest to its lowest value,
    /// and the work of the kicks.
    pub fn gain(&self) -> f64 {
        self.gain_j / (self.most_j - self.least_j + self.kicks_j).max(1e-9)
    }
}

/// The most that contacts can hold, J.
pub fn held(world: &World) -> f64 {
    let config = world.model().config();
    let mut sum = 0.0;
    for contact in world.contact_forces() {
        let normal = contact.force.dot(contact.normal);
        let friction = (contact.force - contact.normal * normal).length_squared();
        let depth = (-contact.distance).max(0.0);
        sum += 0.5 * depth * normal.max(config.contact_stiffness * depth);
        sum += 0.5 * friction / config.anchor_stiffness;
    }
    sum
}
