//! Base frame and initial pose of a hand, from `[base]` and `[start]` in `hand.toml`.

use super::report::Report;
use super::settings::Settings;
use super::start_settings::BaseSettings;
use super::urdf::tree::{Urdf, pose};
use crate::error::ModelError;
use crate::hand::{Coordinate, Motor, Start, Tendon};
use crate::{Pose, Rotation, Vec3, rotation};

/// Pose of the base frame in the frame of the URDF's root.
pub(crate) fn root_from_base(base: &BaseSettings, tree: &Urdf, at: &Report) -> Result<Pose, ModelError> {
    let bad = |problem: &str, valid: &str| Err(at.bad("[base]", problem, valid));
    let turn = match (base.quat_xyzw, base.rpy) {
        (Some(_), Some(_)) => return bad("has quat_xyzw and rpy", "one of them"),
        (None, rpy) => rotation::from_rpy(rpy.unwrap_or_default()),
        (Some([x, y, z, w]), None) => {
            let turn = Rotation::from_xyzw(x, y, z, w);
            if turn.length() < 1e-6 {
                return bad("has quat_xyzw without a direction", "a quaternion x, y, z, w");
            }
            turn.normalize()
        }
    };
    let mut root_from_base = Pose::from_parts(Vec3::from_array(base.position), turn);
    let Some(link) = &base.link else { return Ok(root_from_base) };
    let robot = &tree.robot;
    let Some(mut at_link) = robot.links.iter().position(|l| l.name == *link) else {
        return bad(&format!("names link '{link}', which is not there"), "a <link> of the URDF");
    };
    while at_link != tree.root {
        let joint = tree.child_link.iter().position(|&child| child == at_link);
        let Some(joint) = joint.map(|j| &robot.joints[j]) else { break };
        if joint.joint_type != urdf_rs::JointType::Fixed {
            let problem = format!("names link '{link}', which joint '{}' moves", joint.name);
            return bad(&problem, "the root, or a link that fixed joints join to it");
        }
        root_from_base = pose(&joint.origin) * root_from_base;
        let parent = robot.links.iter().position(|l| l.name == joint.parent.link);
        let Some(parent) = parent else { break };
        at_link = parent;
    }
    Ok(root_from_base)
}

/// A start may be beyond a limit by the rounding of its file, rad (m).
const BEYOND_LIMIT: f64 = 1e-6;

/// The start of the hand. Errors are kept. Without `[start]`, each servo begins where its joint's spring rests.
pub(crate) fn start(
    settings: &Settings,
    coordinates: &[Coordinate],
    motors: &[Motor],
    tendons: &[Tendon],
    at: &Report,
) -> Start {
    let own = &settings.start;
    let unknown = |kind: &str, name: &str, known: Vec<&str>| {
        let element = format!("[start] {kind}");
        let valid = format!("one of: {}", known.join(", "));
        at.keep::<()>(Err(at.bad(element, format!("names '{name}'"), valid)));
    };
    let motor_names = || motors.iter().map(|m| m.name.as_str()).collect::<Vec<_>>();
    for name in own.motors.keys().filter(|name| !motor_names().contains(&name.as_str())) {
        unknown("motors", name, motor_names());
    }
    let joint_names = || coordinates.iter().map(|c| c.name.as_str()).collect::<Vec<_>>();
    for name in own.joints.keys().filter(|name| !joint_names().contains(&name.as_str())) {
        unknown("joints", name, joint_names());
    }
    for c in coordinates {
        let Some(&q) = own.joints.get(&c.name) else { continue };
        let beyond = f64::max(c.lower - q, q - c.upper);
        if beyond > BEYOND_LIMIT {
            let valid = format!("{} to {}, the limits of the joint", c.lower, c.upper);
            at.keep::<()>(Err(at.bad("[start]", format!("has joints.{} {q}", c.name), valid)));
        }
    }
    // `clamp` panics at the limits of a joint that is in error.
    let within = |c: &Coordinate, q: f64| {
        if q < c.lower {
            c.lower
        } else if q > c.upper {
            c.upper
        } else {
            q
        }
    };
    let of_joint = |c: &Coordinate| own.joints.get(&c.name).copied().unwrap_or(c.rest);
    let q: Vec<f64> = coordinates.iter().map(|c| within(c, of_joint(c))).collect();
    let sigma: Vec<f64> = motors
        .iter()
        .enumerate()
        .map(|(m, motor)| {
            let servo = servo_of(m, tendons);
            let placed =
                servo.filter(|&(c, _)| own.joints.contains_key(&coordinates[c].name) || own.sigma.is_none());
            let of_servo = placed.map(|(c, rest)| (q[c] - rest) / motor.scaling + motor.offset);
            let sigma = own.motors.get(&motor.name).copied().or(of_servo).or(own.sigma);
            sigma.unwrap_or(0.0).clamp(0.0, 1.0)
        })
        .collect();
    Start {
        sigma: if sigma.iter().all(|sigma| *sigma == 0.0) { Vec::new() } else { sigma },
        q: if own.joints.is_empty() { Vec::new() } else { q },
    }
}

/// The coordinate that the motor of a servo holds, and the position at which it has wound nothing; `None` for other motors.
fn servo_of(motor: usize, tendons: &[Tendon]) -> Option<(usize, f64)> {
    let mut own = tendons.iter().filter(|tendon| tendon.motors.iter().any(|(m, _)| *m == motor));
    match (own.next(), own.next()) {
        (Some(tendon), None)
            if tendon.both_ways && tendon.elements.is_empty() && tendon.motors == [(motor, 1.0)] =>
        {
            match tendon.moment_arms.as_slice() {
                &[(coordinate, 1.0)] => Some((coordinate, tendon.rest)),
                _ => None,
            }
        }
        _ => None,
    }
}
