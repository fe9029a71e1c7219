//! The independent coordinates of a hand: limits, dampers and dry friction from the URDF's joints, springs from its transmissions.

use urdf_rs::{Joint, JointLimit, JointType};

use super::report::Report;
use super::settings::Settings;
use super::urdf::reduce::Reduced;
use super::urdf::transmission::TransmissionJoint;
use super::urdf::tree::Urdf;
use crate::error::ModelError;
use crate::hand::{Coordinate, CoordinateSettings};

/// Each coordinate; spring, damper and dry friction of `hand.toml` replace those of the URDF. Invalid limits and springs are kept
/// as errors.
pub(crate) fn coordinates(
    tree: &Urdf,
    reduced: &Reduced,
    settings: &Settings,
    report: &mut Report,
) -> Vec<Coordinate> {
    let mut out = Vec::new();
    for &leader in &reduced.coordinates {
        let name = tree.robot.joints[leader].name.clone();
        let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut damping, mut friction) = (0.0, 0.0);
        let mut sound = true;
        for (joint, motion) in tree.robot.joints.iter().zip(&reduced.motions) {
            let Some(motion) = motion.filter(|m| m.leader == leader) else { continue };
            if let Some(dynamics) = &joint.dynamics {
                // A damper on x = ratio q + offset dissipates d ẋ² = d ratio² q̇².
                damping += motion.ratio * motion.ratio * dynamics.damping;
                // Dry friction dissipates c |ẋ| = c |ratio q̇|.
                friction += motion.ratio.abs() * dynamics.friction;
            }
            if joint.joint_type != JointType::Continuous {
                sound &= report.keep(check_limits(joint, report)).is_some();
                // The limits of a follower apply to its leader.
                let a = (joint.limit.lower - motion.offset) / motion.ratio;
                let b = (joint.limit.upper - motion.offset) / motion.ratio;
                lower = f64::max(lower, a.min(b));
                upper = f64::min(upper, a.max(b));
            }
        }
        if sound && lower >= upper {
            report.keep::<()>(Err(no_range(tree, reduced, leader, report)));
        }
        let every = &settings.every_coordinate;
        let stated = settings.coordinates.get(&name).map_or(*every, |own| own.or(every));
        // Two different springs of the URDF are an error, unless hand.toml states the joint's.
        let stiffness = || {
            let tag = "<mechanicalElasticity>";
            of_joint(tree, &name, tag, |t| t.stated[0].then_some(t.stiffness), report)
        };
        let rest = || of_joint(tree, &name, "<offset>", |t| t.stated[1].then_some(t.rest), report);
        let in_urdf = CoordinateSettings {
            stiffness: stated.stiffness.is_none().then(stiffness),
            damping: Some(damping),
            rest: stated.rest.is_none().then(rest),
            friction: Some(friction),
        };
        let numbers = stated.or(&in_urdf).numbers();
        out.push(Coordinate { name, lower, upper, numbers });
    }
    out
}

/// A number that transmissions state for a joint; 0 if none does. Two different ones are an error.
fn of_joint(
    tree: &Urdf,
    joint: &str,
    tag: &str,
    number: impl Fn(&TransmissionJoint) -> Option<f64>,
    report: &Report,
) -> f64 {
    let mut stated = tree.transmissions.iter().flat_map(|t| {
        let of = t.joints.iter().filter(|j| j.joint == joint).filter_map(&number);
        of.map(|number| (t.name.as_str(), number))
    });
    let Some((first, value)) = stated.next() else { return 0.0 };
    if let Some((other, different)) = stated.find(|(_, other)| *other != value) {
        report.keep::<()>(Err(report.bad(
            format!("joint '{joint}'"),
            format!("{tag} is {value} in transmission '{first}' and {different} in transmission '{other}'"),
            "one value: it belongs to the joint",
        )));
    }
    value
}

fn check_limits(joint: &Joint, report: &Report) -> Result<(), ModelError> {
    let JointLimit { lower, upper, .. } = joint.limit;
    if lower < upper {
        return Ok(());
    }
    Err(report.bad(
        format!("joint '{}'", joint.name),
        format!("has limits {lower} to {upper}"),
        "<limit lower=… upper=…> with lower < upper",
    ))
}

/// The error about limits of mimics that leave their leader no range. It names the first mimic that does.
fn no_range(tree: &Urdf, reduced: &Reduced, leader: usize, report: &Report) -> ModelError {
    let name = &tree.robot.joints[leader].name;
    let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
    let own = &tree.robot.joints[leader];
    if own.joint_type != JointType::Continuous {
        (lower, upper) = (own.limit.lower, own.limit.upper);
    }
    for (joint, motion) in tree.robot.joints.iter().zip(&reduced.motions) {
        let Some(motion) = motion.filter(|m| m.leader == leader) else { continue };
        if joint.joint_type == JointType::Continuous || joint.name == *name {
            continue;
        }
        let (from, to) = (joint.limit.lower, joint.limit.upper);
        let (a, b) = ((from - motion.offset) / motion.ratio, (to - motion.offset) / motion.ratio);
        let (low, high) = (lower.max(a.min(b)), upper.min(a.max(b)));
        if low >= high {
            let (c, d) = (motion.ratio * lower + motion.offset, motion.ratio * upper + motion.offset);
            // Without the sign of −0.
            let [a, b, c, d] = [a.min(b), a.max(b), c.min(d), c.max(d)].map(|x| x + 0.0);
            return report.bad(
                format!("joint '{}'", joint.name),
                format!(
                    "mimics '{name}'; its limits {from} to {to} let '{name}' move from {a} to {b} only, \
                     which leaves nothing of {lower} to {upper}"
                ),
                format!("limits within {c} to {d}"),
            );
        }
        (lower, upper) = (low, high);
    }
    report.bad(format!("joint '{name}'"), format!("has limits {lower} to {upper}"), "lower < upper")
}
