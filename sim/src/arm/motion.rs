//! How far the joints of an arm come in a time, within their ranges and speeds.

use super::inverse::reach;
use crate::actuation::base::{bounded, shortest_turn};
use crate::config::BaseConfig;
use palmares_models::arm::{Arm, ArmJoint};
use palmares_models::{Pose, Rotation, Vec3};

/// Steps towards the pose of a tick, which is near.
const STEPS: usize = 10;

/// Joints after a time `dt_s` on the way to `target`, each as fast as it may.
pub fn towards_joints(arm: &Arm, q: &[f64], target: &[f64], dt_s: f64) -> Vec<f64> {
    let target = arm.within(target);
    let step = |((joint, q), target): ((&ArmJoint, &f64), &f64)| {
        let most = joint.speed * dt_s;
        // A target within reach is reached without rounding.
        if (target - q).abs() <= most { *target } else { q + (target - q).clamp(-most, most) }
    };
    arm.joints.iter().zip(q).zip(&target).map(step).collect()
}

/// Joints after a time on the way of the base to a pose: along the straight line within the base's limits, as far as ranges and speeds of
/// the joints let it.
pub fn towards_pose(arm: &Arm, q: &[f64], to: Pose, base: &BaseConfig, dt_s: f64) -> Vec<f64> {
    let at = arm.base_at(q);
    let way = bounded(to.translation - at.translation, base.speed_limit * dt_s);
    let turn = bounded(shortest_turn(at.rotation, to.rotation), base.angular_speed_limit * dt_s);
    moved(arm, q, at, way, turn, dt_s)
}

/// Joints after a time in which the base keeps a velocity within its limits.
pub fn towards_twist(
    arm: &Arm,
    q: &[f64],
    linear: Vec3,
    angular: Vec3,
    base: &BaseConfig,
    dt_s: f64,
) -> Vec<f64> {
    let way = bounded(linear, base.speed_limit) * dt_s;
    let turn = bounded(angular, base.angular_speed_limit) * dt_s;
    moved(arm, q, arm.base_at(q), way, turn, dt_s)
}

fn moved(arm: &Arm, q: &[f64], at: Pose, way: Vec3, turn: Vec3, dt_s: f64) -> Vec<f64> {
    if way == Vec3::ZERO && turn == Vec3::ZERO {
        return q.to_vec();
    }
    let rotation = (Rotation::from_scaled_axis(turn) * at.rotation).normalize();
    let found = reach(arm, q, Pose::from_parts(at.translation + way, rotation), STEPS).q;
    // All joints slow down as one, so that the base keeps its direction.
    let excess = arm
        .joints
        .iter()
        .zip(q)
        .zip(&found)
        .fold(1.0, |most: f64, ((joint, q), found)| most.max((found - q).abs() / (joint.speed * dt_s)));
    // No rounding beyond a range.
    arm.within(&q.iter().zip(&found).map(|(q, found)| q + (found - q) / excess).collect::<Vec<f64>>())
}

/// Velocity of the base for speeds of the joints.
pub fn linear_and_angular(arm: &Arm, q: &[f64], speeds: &[f64]) -> (Vec3, Vec3) {
    let zero = (Vec3::ZERO, Vec3::ZERO);
    let columns = arm.jacobian(q);
    columns
        .iter()
        .zip(speeds)
        .fold(zero, |(v, w), ((linear, angular), speed)| (v + *linear * *speed, w + *angular * *speed))
}
