//! Results of a step besides the state: solver statistics, contact forces, and the ends of its phases.

use crate::model::Owner;
use palmares_models::Vec3;
use serde::{Deserialize, Serialize};

/// Statistics of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepOutcome {
    /// Newton iterations of the island that needed the most.
    pub iterations: usize,
    /// Line search evaluations over all islands.
    pub evaluations: usize,
    /// Whether every island reached the tolerance.
    pub converged: bool,
    /// Number of contact points in the solver.
    pub points: usize,
    /// Deepest overlap of shapes at the start of the step, m.
    pub penetration_m: f64,
    /// Number of islands solved.
    pub islands: usize,
    /// Number of bodies asleep at the end of the step.
    pub asleep: usize,
    /// Computing of the step, in the unit of [`crate::bounds`].
    pub work: u64,
}

/// A touching contact in the solution of the last step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactForce {
    /// First body.
    pub a: Owner,
    /// Second body.
    pub b: Owner,
    /// Their shapes, as indices in the model's list of colliders.
    pub colliders: (u32, u32),
    /// Position in the world, m.
    pub position: Vec3,
    /// Point at which its friction acts, m: in a patch of several points, nearer to the middle than the
    /// position.
    pub friction_at: Vec3,
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// Force on B, N.
    pub force: Vec3,
    /// Torque on B about the normal, for a point that resists spin like a small disc, N·m.
    pub torque: Vec3,
    /// Gap at the start of the step, m.
    pub distance: f64,
}

impl ContactForce {
    /// Point of application of its normal force, m, and that force on B, N; then the same for its friction.
    pub fn parts(&self) -> [(Vec3, Vec3); 2] {
        let normal = self.normal * self.force.dot(self.normal);
        [(self.position, normal), (self.friction_at, self.force - normal)]
    }
}

/// Phases of a step, for timing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepPhase {
    /// Kinematics, mass matrix, bias.
    Dynamics,
    /// Broad and narrow phase.
    Collision,
    /// Islands, Newton, integration.
    Solver,
}

/// Observer of the phases of a step; this crate has no clock.
pub trait PhaseTimer {
    /// Called when `phase` has ended.
    fn ended(&mut self, phase: StepPhase);
}

impl PhaseTimer for () {
    fn ended(&mut self, _: StepPhase) {}
}
