//! How the arm that carries the hand moves in a run.

use super::Run;
use super::carrying::{ArmState, Carrying, Swing};
use super::targets::BaseMotion;
use crate::action::BaseTarget;
use crate::observation::ArmReading;
use palmares_models::arm::Arm;
use palmares_sim::arm;
use std::sync::Arc;

/// Steps from where the joints are sent to where they are with the base.
const READING_STEPS: usize = 10;

impl Run {
    /// Sets the joints to where they shall be after the next tick, if there is an arm.
    pub(super) fn swing(&mut self) -> Option<Swing> {
        let tick_s = self.task.tick_s;
        let Carrying { arm: it, state } = self.carrying.as_mut()?;
        let base = &self.world.model().config().base;
        let to = match (&self.target, &self.applied.base) {
            (BaseMotion::Joints, Some(BaseTarget::Joints { joints })) => {
                arm::towards_joints(it, &state.set, joints, tick_s)
            }
            (BaseMotion::Pose { to, .. }, _) => arm::towards_pose(it, &state.set, *to, base, tick_s),
            (BaseMotion::Twist { linear, angular }, _) => {
                arm::towards_twist(it, &state.set, *linear, *angular, base, tick_s)
            }
            (BaseMotion::Joints, _) => state.set.clone(),
        };
        let from = std::mem::replace(&mut state.set, to);
        Some(Swing::between(from, &state.set, tick_s))
    }

    /// Reads the joints after a tick.
    pub(super) fn read_arm(&mut self) {
        let Some(Carrying { arm: it, state }) = &mut self.carrying else { return };
        let read = arm::reach(it, &state.set, self.world.state().base, READING_STEPS).q;
        let tick_s = self.task.tick_s;
        state.speed = read.iter().zip(&state.read).map(|(now, before)| (now - before) / tick_s).collect();
        state.read = read;
    }

    /// The joints of the arm, if there is one.
    pub fn arm_reading(&self) -> Option<ArmReading> {
        let ArmState { read, speed, .. } = &self.carrying.as_ref()?.state;
        Some(ArmReading { position: read.clone(), velocity: speed.clone() })
    }

    /// The arm that carries the hand.
    pub fn arm(&self) -> Option<&Arc<Arm>> {
        self.carrying.as_ref().map(|carrying| &carrying.arm)
    }
}
