//! A tick: from an action to the commands of base and motors in every step, and to the events after it.
//!
//! An applied action is its own clipped form, so that the applied actions play the run again, bit for bit.

use super::Run;
use super::targets::BaseMotion;
use super::watch::StepWatch;
use crate::action::{Action, ActionError, ActionLimits, BaseTarget, clipped, unit};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::base::shortest_turn;
use palmares_sim::state::BaseReference;
use palmares_sim::{BaseCommand, Command};

impl Run {
    /// Whether [`Run::step`] would take this action.
    pub fn check(&self, action: &Action) -> Result<(), ActionError> {
        action.check(&self.hand)?;
        let Some(BaseTarget::Joints { joints }) = &action.base else { return Ok(()) };
        match self.arm() {
            None => Err(ActionError::NoArm { task: self.task.name.clone() }),
            Some(arm) if arm.joints.len() != joints.len() => {
                Err(ActionError::WrongJoints { got: joints.len(), expected: arm.joints.len() })
            }
            Some(_) => Ok(()),
        }
    }

    /// Advances the world by one tick under `action`. A refused action changes nothing.
    pub fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        self.step_watched(action, &mut ())
    }

    /// Advances the world by one tick as [`Run::step`] does, and shows every step to `watch`.
    pub fn step_watched(&mut self, action: &Action, watch: &mut impl StepWatch) -> Result<(), ActionError> {
        self.check(action)?;
        match self.arriving(action) {
            Some(arrived) => self.apply(&arrived),
            None => self.apply(action),
        }
        let before = self.motor_states();
        self.computed = self.advance(watch);
        self.tick += 1;
        self.add_motor_work(&before);
        self.read_arm();
        self.sensors.tick(&self.world, self.tick);
        self.remember_poses();
        self.push_on();
        let objects = self.sightings();
        self.news = self.referee.watch(self.tick, &objects);
        self.history.extend(self.news.iter().cloned());
        Ok(())
    }

    /// Clips an action to the spec and makes it the present one. Fields that it omits keep their values.
    pub(super) fn apply(&mut self, action: &Action) {
        let limits = &self.world.model().config().base;
        if let Some(base) = &action.base {
            let (clipped, target) = match base {
                BaseTarget::Pose { position, quat_xyzw } => {
                    let position = position.map(|x| x.clamp(-ActionLimits::REACH_M, ActionLimits::REACH_M));
                    // The check has refused a quaternion without a direction.
                    let rotation = unit(*quat_xyzw).unwrap_or(Rotation::IDENTITY);
                    let to = Pose::from_parts(Vec3::from_array(position), rotation);
                    let from = self.origin_of(to);
                    let quat_xyzw = rotation.to_array();
                    (BaseTarget::Pose { position, quat_xyzw }, BaseMotion::Pose { from, to })
                }
                BaseTarget::Twist { linear, angular } => {
                    let linear = clipped(Vec3::from_array(*linear), limits.speed_limit);
                    let angular = clipped(Vec3::from_array(*angular), limits.angular_speed_limit);
                    let clipped =
                        BaseTarget::Twist { linear: linear.to_array(), angular: angular.to_array() };
                    (clipped, BaseMotion::Twist { linear, angular })
                }
                BaseTarget::Joints { joints } => {
                    // The check has refused joints without an arm.
                    let joints = self.arm().map_or_else(|| joints.clone(), |arm| arm.within(joints));
                    (BaseTarget::Joints { joints }, BaseMotion::Joints)
                }
            };
            self.target = target;
            self.applied.base = Some(clipped);
        } else if let BaseMotion::Pose { to, .. } = self.target {
            self.target = BaseMotion::Pose { from: to, to };
        }
        if let Some(sigma) = &action.hand {
            self.applied.hand = Some(sigma.iter().map(|x| x.clamp(0.0, 1.0)).collect());
        }
        if let Some(effort) = &action.effort {
            self.applied.effort = Some(effort.iter().map(|x| x.clamp(0.0, 1.0)).collect());
        }
    }

    /// The begin of a pose target's path in this tick. A target within the speed limits of the last one is a point of a path,
    /// which begins there. A farther one is approached at the limits.
    fn origin_of(&self, to: Pose) -> Pose {
        let limits = &self.world.model().config().base;
        match self.target {
            BaseMotion::Pose { to: last, .. } => {
                let tick_s = self.task.tick_s;
                let path = (to.translation - last.translation).length() <= limits.speed_limit * tick_s
                    && shortest_turn(last.rotation, to.rotation).length()
                        <= limits.angular_speed_limit * tick_s;
                if path { last } else { to }
            }
            BaseMotion::Twist { .. } | BaseMotion::Joints => to,
        }
    }

    /// Steps a tick; returns its computing.
    pub(super) fn advance(&mut self, watch: &mut impl StepWatch) -> u64 {
        self.prepared = None;
        let mut work = 0;
        let steps = self.task.steps_per_tick();
        let mut command = Command {
            base: BaseCommand::stay(Pose::IDENTITY),
            sigma: self.applied.hand.clone().unwrap_or_default(),
            effort: self.applied.effort.clone().unwrap_or_default(),
            pushes: Vec::new(),
        };
        let shaking = self.referee.shaking(self.tick);
        if shaking.is_some() && self.shaken_at.is_none() {
            self.shaken_at = Some(self.world.state().reference.pose);
        }
        let swing = if shaking.is_none() { self.swing() } else { None };
        for k in 1..=steps {
            if let (Some((since_s, shake)), Some(at)) = (shaking, self.shaken_at) {
                let (offset, velocity) = shake.motion(since_s + k as f64 * self.task.step_s);
                command.base = BaseCommand::Exact(BaseReference {
                    pose: Pose::from_parts(at.translation + offset, at.rotation),
                    linear: velocity,
                    angular: Vec3::ZERO,
                });
                self.pushes_into(&mut command.pushes);
                self.push_objects();
                work += self.world.step_timed(&command, watch).work;
                watch.stepped(&self.world);
                continue;
            }
            let part = k as f64 / steps as f64;
            command.base = match self.target {
                _ if let (Some(swing), Some(arm)) = (&swing, self.arm()) => swing.command(arm, part),
                BaseMotion::Pose { from, to } => {
                    let turn = shortest_turn(from.rotation, to.rotation);
                    let travel = to.translation - from.translation;
                    let target = Pose::from_parts(
                        from.translation + travel * part,
                        (Rotation::from_scaled_axis(turn * part) * from.rotation).normalize(),
                    );
                    let rate = 1.0 / self.task.tick_s;
                    BaseCommand::Pose { target, linear: travel * rate, angular: turn * rate }
                }
                BaseMotion::Twist { linear, angular } => BaseCommand::Twist { linear, angular },
                BaseMotion::Joints => BaseCommand::stay(self.world.state().reference.pose),
            };
            self.pushes_into(&mut command.pushes);
            self.push_objects();
            work += self.world.step_timed(&command, watch).work;
            watch.stepped(&self.world);
        }
        work
    }
}
