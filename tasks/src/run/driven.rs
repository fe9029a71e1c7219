//! What drives the hand of a run between two actions.

use palmares_models::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// What the base is doing between two commands.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) enum Target {
    /// Go from one pose to the next during the tick, then stay.
    Pose { from: Pose, to: Pose },
    /// Keep a velocity.
    Twist { linear: Vec3, angular: Vec3 },
}

/// A wrench that acts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pushing {
    pub link: usize,
    pub force: Vec3,
    pub torque: Vec3,
    pub ticks_left: u64,
}
