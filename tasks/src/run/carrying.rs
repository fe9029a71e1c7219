//! The arm of a run and its joints.

use crate::action::BaseTarget;
use crate::settle::SceneError;
use crate::task::Task;
use palmares_models::Pose;
use palmares_models::arm::Arm;
use palmares_sim::{BaseCommand, arm};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// An arm and its joints.
#[derive(Clone)]
pub(super) struct Carrying {
    pub(super) arm: Arc<Arm>,
    pub(super) state: ArmState,
}

/// Joints of an arm, rad or m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ArmState {
    /// Where the drives are sent.
    pub(super) set: Vec<f64>,
    /// Where they are, with the base where it is.
    pub(super) read: Vec<f64>,
    /// Their change in the last tick, 1/s.
    pub(super) speed: Vec<f64>,
}

impl ArmState {
    pub(super) fn fits(&self, arm: &Arm) -> bool {
        let fits = |all: &Vec<f64>| all.len() == arm.joints.len() && all.iter().all(|x| x.is_finite());
        [&self.set, &self.read, &self.speed].into_iter().all(fits) && arm.within(&self.set) == self.set
    }
}

impl Carrying {
    /// The task's arm with the hand at its start.
    pub(super) fn new(task: &Task, base: Pose) -> Result<Option<Self>, SceneError> {
        let Some(carrier) = &task.arm else { return Ok(None) };
        let mut it = Carrying { arm: Arc::clone(carrier.arm()), state: ArmState::at(carrier.guess()) };
        it.put(base).map_err(|gap| {
            SceneError::unsound(task, format!("the hand's start is out of the arm's reach: {gap}"))
        })?;
        Ok(Some(it))
    }

    /// Puts the joints where the base is at a pose, from where they are; or returns how far it is from there.
    pub(super) fn put(&mut self, base: Pose) -> Result<(), String> {
        let found = arm::place(&self.arm, &self.state.set, base);
        if !found.is_there() {
            return Err(format!(
                "the nearest pose is {:.3} m and {:.3} rad away",
                found.gap_m, found.gap_rad
            ));
        }
        self.state = ArmState::at(found.q);
        Ok(())
    }

    /// The applied target of these joints.
    pub(super) fn target(&self) -> BaseTarget {
        BaseTarget::Joints { joints: self.state.set.clone() }
    }
}

impl ArmState {
    fn at(q: Vec<f64>) -> Self {
        ArmState { speed: vec![0.0; q.len()], read: q.clone(), set: q }
    }
}

/// The set point of the joints in the steps of a tick.
pub(super) struct Swing {
    from: Vec<f64>,
    speeds: Vec<f64>,
    tick_s: f64,
}

impl Swing {
    /// The way between two positions of the joints in a tick.
    pub(super) fn between(from: Vec<f64>, to: &[f64], tick_s: f64) -> Self {
        let speeds = to.iter().zip(&from).map(|(to, from)| (to - from) / tick_s).collect();
        Swing { from, speeds, tick_s }
    }

    /// The command of the base after a part of the tick.
    pub(super) fn command(&self, arm: &Arm, part: f64) -> BaseCommand {
        let q: Vec<f64> =
            self.from.iter().zip(&self.speeds).map(|(q, speed)| q + speed * (part * self.tick_s)).collect();
        let (linear, angular) = arm::linear_and_angular(arm, &q, &self.speeds);
        BaseCommand::Pose { target: arm.base_at(&q), linear, angular }
    }
}
