//! Commands to a world for one step.

use crate::actuation::base::BaseCommand;
use crate::model::Model;
use palmares_models::{Pose, Vec3};

/// Command for one step.
#[derive(Clone, Debug)]
pub struct Command {
    /// Command to the base.
    pub base: BaseCommand,
    /// σ of every motor, clamped to [0, 1].
    pub sigma: Vec<f64>,
    /// External forces: the paper's virtual contacts.
    pub pushes: Vec<Push>,
}

impl Command {
    /// Stay at a pose with the motors at rest.
    pub fn stay(model: &Model, pose: Pose) -> Self {
        Command {
            base: BaseCommand::stay(pose),
            sigma: vec![0.0; model.hand().map_or(0, |hand| hand.motors.len())],
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
