//! Commands to a world for one step.

use crate::model::Model;
use crate::state::BaseReference;
use palmares_models::{Pose, Vec3};

/// Command for one step.
#[derive(Clone, Debug)]
pub struct Command {
    /// Command to the base.
    pub base: BaseCommand,
    /// σ of every motor, clamped to [0, 1].
    pub sigma: Vec<f64>,
    /// Part of its largest force that every motor may use, clamped to [0, 1]; a motor that the list leaves out keeps its own, which is
    /// 1 in the beginning.
    pub effort: Vec<f64>,
    /// External forces: the paper's virtual contacts.
    pub pushes: Vec<Push>,
}

impl Command {
    /// Stay at a pose with the motors where they begin.
    pub fn stay(model: &Model, pose: Pose) -> Self {
        Command {
            base: BaseCommand::stay(pose),
            sigma: model.hand().map_or(Vec::new(), |hand| {
                (0..hand.motors.len()).map(|motor| hand.start.sigma_of(motor)).collect()
            }),
            effort: Vec::new(),
            pushes: Vec::new(),
        }
    }
}

/// A force on a link of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Index of the link.
    pub link: usize,
    /// Point of application in the link frame, m.
    pub point: Vec3,
    /// Force in the world frame, N.
    pub force: Vec3,
}

/// Command to the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BaseCommand {
    /// Move to a pose and stay, within the limits. `linear` and `angular` give the target's own motion, so
    /// that the base follows a smooth path without lag.
    Pose {
        /// Target pose.
        target: Pose,
        /// Velocity of the target, m/s.
        linear: Vec3,
        /// Angular velocity of the target, rad/s.
        angular: Vec3,
    },
    /// Keep a velocity, within the limits.
    Twist {
        /// m/s
        linear: Vec3,
        /// rad/s
        angular: Vec3,
    },
    /// Set point of the servo itself: a path computed elsewhere, with no limits applied here.
    Exact(BaseReference),
    /// The servo is off: the hand flies as a free body.
    Free,
}

impl BaseCommand {
    /// Stay at a pose.
    pub fn stay(target: Pose) -> Self {
        BaseCommand::Pose { target, linear: Vec3::ZERO, angular: Vec3::ZERO }
    }
}
