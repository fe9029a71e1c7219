//! The free-flying base: a set point that obeys speed limits, and a saturated servo that follows it.

use crate::command::BaseCommand;
use crate::config::{BaseConfig, Config};
use crate::solver::terms::{AxisTerm, ScalarLaw};
use crate::state::BaseReference;
use palmares_models::{Pose, Rotation, Vec3};

/// Advances the set point by one step under a command. `at` is the base's pose. Anti-windup: while the servo
/// saturates, the set point of a blocked base waits; otherwise the base would jump when it comes free.
pub fn advance(config: &Config, at: Pose, reference: &mut BaseReference, command: &BaseCommand) {
    let (h, base) = (config.step_s, &config.base);
    // A base that is bolted, and stays, has no distance to cover.
    let resting = BaseReference { pose: at, linear: Vec3::ZERO, angular: Vec3::ZERO };
    if base.bolted && *reference == resting && *command == BaseCommand::stay(at) {
        return;
    }
    if matches!(command, BaseCommand::Pose { .. } | BaseCommand::Twist { .. }) {
        wait_for(at, reference, base);
    }
    match *command {
        BaseCommand::Exact(exact) => *reference = exact,
        BaseCommand::Free => {}
        BaseCommand::Twist { linear, angular } => {
            let linear = bounded(linear, base.speed_limit);
            let angular = bounded(angular, base.angular_speed_limit);
            turn_towards(reference, linear, angular, h, base);
        }
        BaseCommand::Pose { target, linear, angular } => {
            // Remaining offset when the set point moves along with the target.
            let offset = target.translation - reference.pose.translation - linear * h;
            let rotation = shortest_turn(reference.pose.rotation, target.rotation) - angular * h;
            let linear = bounded(approach(offset, linear, base.acceleration_limit, h), base.speed_limit);
            let angular = bounded(
                approach(rotation, angular, base.angular_acceleration_limit, h),
                base.angular_speed_limit,
            );
            turn_towards(reference, linear, angular, h, base);
        }
    }
}

/// Moves the set point back to where the servo just saturates.
fn wait_for(at: Pose, reference: &mut BaseReference, base: &BaseConfig) {
    let lead = reference.pose.translation - at.translation;
    let most = base.force_limit / base.stiffness;
    if lead.length() > most {
        reference.pose.translation = at.translation + bounded(lead, most);
    }
    let turn = shortest_turn(at.rotation, reference.pose.rotation);
    let most = base.torque_limit / base.angular_stiffness;
    if turn.length() > most {
        reference.pose.rotation = (Rotation::from_scaled_axis(bounded(turn, most)) * at.rotation).normalize();
    }
}

fn turn_towards(reference: &mut BaseReference, linear: Vec3, angular: Vec3, h: f64, base: &BaseConfig) {
    reference.linear += bounded(linear - reference.linear, base.acceleration_limit * h);
    reference.angular += bounded(angular - reference.angular, base.angular_acceleration_limit * h);
    reference.pose.translation += reference.linear * h;
    reference.pose.rotation =
        (Rotation::from_scaled_axis(reference.angular * h) * reference.pose.rotation).normalize();
}

/// Velocity that closes `offset` to a target moving at `target`, as fast as braking with the limit `a`
/// allows: the speed is `−a h/2 + √((a h/2)² + 2 a d)` until the last step.
fn approach(offset: Vec3, target: Vec3, a: f64, h: f64) -> Vec3 {
    let distance = offset.length();
    if distance == 0.0 {
        return target;
    }
    let half = 0.5 * a * h;
    let brake = (half * half + 2.0 * a * distance).sqrt() - half;
    target + offset * (brake.min(distance / h) / distance)
}

/// `v`, shortened to at most `limit`.
pub fn bounded(v: Vec3, limit: f64) -> Vec3 {
    let length = v.length();
    if length > limit { v * (limit / length) } else { v }
}

/// Rotation vector that takes `from` to `to` by the shorter way.
pub fn shortest_turn(from: Rotation, to: Rotation) -> Vec3 {
    let turn = to * from.inverse();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.to_scaled_axis()
}

/// Translation and turn from the base's pose to its set point.
pub(crate) fn way(reference: &BaseReference, base: Pose) -> [f64; 6] {
    let [x, y, z] = (reference.pose.translation - base.translation).to_array();
    let [a, b, c] = shortest_turn(base.rotation, reference.pose.rotation).to_array();
    [x, y, z, a, b, c]
}

/// The servo's spring along and about each world axis, in the order of velocities: error, velocity of the set
/// point, stiffness, damping and limit.
fn axes(servo: &BaseConfig, reference: &BaseReference, base: Pose) -> [[f64; 5]; 6] {
    let (linear, angular) = (reference.linear.to_array(), reference.angular.to_array());
    let way = way(reference, base);
    std::array::from_fn(|i| match i {
        0..3 => [way[i], linear[i], servo.stiffness, servo.damping, servo.force_limit],
        _ => [way[i], angular[i - 3], servo.angular_stiffness, servo.angular_damping, servo.torque_limit],
    })
}

/// The servo as six saturated spring-dampers along the world axes, implicit in the solve.
pub(crate) fn servo(
    servo: &BaseConfig,
    reference: &BaseReference,
    base: Pose,
    h: f64,
    terms: &mut Vec<AxisTerm>,
) {
    // The set point is the one at the end of the step, and so is the implicit law: f = k (x_ref,1 − x_1) + …
    for (dof, [error, target, stiffness, damping, limit]) in
        axes(servo, reference, base).into_iter().enumerate()
    {
        let law = ScalarLaw::Servo { h, stiffness, damping, error, target, limit };
        terms.push(AxisTerm { dof, sign: 1.0, law });
    }
}

/// Force and torque of the servo when the base has velocity `v`.
pub(crate) fn pull(servo: &BaseConfig, reference: &BaseReference, base: Pose, v: &[f64]) -> [f64; 6] {
    let axes = axes(servo, reference, base);
    std::array::from_fn(|i| {
        let [error, target, stiffness, damping, limit] = axes[i];
        (stiffness * error + damping * (target - v[i])).clamp(-limit, limit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Pose {
        Pose::translation(x, 0.0, 0.0)
    }

    #[test]
    fn a_far_target_is_reached_within_the_limits_and_without_overshoot() {
        let config = Config::default();
        let mut reference = BaseReference { pose: at(0.0), linear: Vec3::ZERO, angular: Vec3::ZERO };
        let (mut last, mut top) = (0.0, 0.0f64);
        for _ in 0..2000 {
            let base = reference.pose;
            advance(&config, base, &mut reference, &BaseCommand::stay(at(1.5)));
            let speed = reference.linear.x;
            assert!(speed - last <= 4.0 * config.step_s + 1e-12);
            assert!(reference.pose.translation.x <= 1.5 + 1e-6);
            (last, top) = (speed, top.max(speed));
        }
        assert!((reference.pose.translation.x - 1.5).abs() < 1e-9);
        assert!(top <= 2.0 + 1e-12 && top > 1.9);
    }

    #[test]
    fn the_set_point_of_a_blocked_base_waits() {
        let config = Config::default();
        let mut reference = BaseReference { pose: at(0.0), linear: Vec3::ZERO, angular: Vec3::ZERO };
        for _ in 0..1000 {
            advance(&config, at(0.0), &mut reference, &BaseCommand::stay(at(1.5)));
        }
        // 500 N at 2e4 N/m, plus one step.
        assert!(reference.pose.translation.x < 0.025 + 2.1 * config.step_s);
    }

    #[test]
    fn a_moving_target_within_the_limits_is_followed_without_lag() {
        let config = Config::default();
        let mut reference = BaseReference { pose: at(0.0), linear: Vec3::ZERO, angular: Vec3::ZERO };
        for k in 1..1000 {
            let t = f64::from(k) * config.step_s;
            let (x, v) = (0.5 * t * t, t);
            let command =
                BaseCommand::Pose { target: at(x), linear: Vec3::new(v, 0.0, 0.0), angular: Vec3::ZERO };
            let base = reference.pose;
            advance(&config, base, &mut reference, &command);
            assert!((reference.pose.translation.x - x).abs() < 1e-5, "{t} {x}");
        }
    }
}
