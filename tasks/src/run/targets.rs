//! Targets of the base and active pushes between two actions.

use palmares_models::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// Target of the base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum BaseMotion {
    /// Go from one pose to the next during the tick, then stay.
    Pose { from: Pose, to: Pose },
    /// Keep a velocity.
    Twist { linear: Vec3, angular: Vec3 },
    /// Bring the joints of the arm to the applied action's.
    Joints,
}

impl BaseMotion {
    /// Whether every number is finite.
    pub(super) fn is_finite(&self) -> bool {
        match self {
            BaseMotion::Pose { from, to } => from.is_finite() && to.is_finite(),
            BaseMotion::Twist { linear, angular } => linear.is_finite() && angular.is_finite(),
            BaseMotion::Joints => true,
        }
    }
}

/// What is pushed.
#[derive(Clone, Copy, Debug)]
pub enum PushedPart<'a> {
    /// The link of this name. Force and torque act at its origin.
    Link(&'a str),
    /// The object of this index. Force and torque act at its centre of mass. No server offers it: the run has no replay from then on.
    Object(usize),
}

/// What is pushed, by its index.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Pushed {
    /// A link of the hand.
    Link(usize),
    /// A free object.
    Object(usize),
}

/// An active push.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pushing {
    pub on: Pushed,
    pub force: Vec3,
    pub torque: Vec3,
    pub ticks_left: u64,
}

impl Pushing {
    /// Whether it is within a force (N) and a torque (N·m), and still active.
    pub(super) fn is_within(&self, (force, torque): (f64, f64)) -> bool {
        within(self.force, force) && within(self.torque, torque) && self.ticks_left > 0
    }
}

/// Whether a vector is finite and at most `most` long.
pub(super) fn within(v: Vec3, most: f64) -> bool {
    v.is_finite() && v.length() <= most
}
