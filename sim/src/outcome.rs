//! What a step tells of itself: how it went, which forces acted, and when its phases ended.

use crate::model::Owner;
use palmares_models::Vec3;
use serde::{Deserialize, Serialize};

/// How a step went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Newton iterations of the island that needed most.
    pub iterations: usize,
    /// Line search evaluations over all islands.
    pub evaluations: usize,
    /// Whether every island reached the tolerance.
    pub converged: bool,
    /// Contact points given to the solver.
    pub points: usize,
    /// Deepest overlap of shapes at the start of the step, m.
    pub penetration_m: f64,
    /// Islands solved.
    pub islands: usize,
    /// Bodies asleep at the end of the step.
    pub asleep: usize,
    /// What the step computed, in the unit of [`crate::bounds`].
    pub work: u64,
}

/// A touching contact as the last step solved it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactForce {
    /// First body.
    pub a: Owner,
    /// Second body.
    pub b: Owner,
    /// Their shapes, as places in the model's list of colliders.
    pub colliders: (u32, u32),
    /// Place in the world, m.
    pub position: Vec3,
    /// Where its friction acts, m: nearer to the middle of a patch of several points than the place itself.
    pub friction_at: Vec3,
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// Force on B, N.
    pub force: Vec3,
    /// Torque on B about the normal, of a point that holds spin like a small disc, N·m.
    pub torque: Vec3,
    /// Gap at the start of the step, m.
    pub distance: f64,
}

impl ContactForce {
    /// Where its normal force acts, m, and that force on B, N; and the same of its friction.
    pub fn parts(&self) -> [(Vec3, Vec3); 2] {
        let normal = self.normal * self.force.dot(self.normal);
        [(self.position, normal), (self.friction_at, self.force - normal)]
    }
}

/// Parts of a step, for those who measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Kinematics, mass matrix, bias.
    Dynamics,
    /// Broad and narrow phase.
    Collision,
    /// Islands, Newton, integration.
    Solver,
}

/// Told when a phase of a step has ended; this crate knows no clock.
pub trait Probe {
    /// `phase` is over.
    fn ended(&mut self, phase: Phase);
}

impl Probe for () {
    fn ended(&mut self, _: Phase) {}
}
