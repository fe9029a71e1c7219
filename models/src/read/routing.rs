//! The way of a cable over its joints, and the guides that it rubs on, from `hand.toml`.

use super::report::Report;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::hand::per_joint::PerJoint;
use crate::hand::tendon::{MAX_EXPONENT, TendonSettings};
use crate::hand::{Guide, Tendon};

/// The guides of a tendon, from the motor outwards; none if it rubs on none. Problems are kept.
pub(super) fn guides(
    tendon: &Tendon,
    own: &TendonSettings,
    tree: &Urdf,
    reduced: &Reduced,
    at: &Report,
) -> Vec<Guide> {
    let TendonSettings { routing, friction, wrap_angle, .. } = own;
    if routing.is_none() && friction.is_none() && wrap_angle.is_none() {
        return Vec::new();
    }
    let element = format!("[tendons.{}]", tendon.name);
    let bad = |problem: String, valid: &str| {
        at.keep::<()>(Err(at.bad(&element, problem, valid)));
        Vec::new()
    };
    let passed = tendon.coordinates();
    let name = |c: usize| tree.robot.joints[reduced.coordinates[c]].name.as_str();
    let names: Vec<&str> = passed.iter().map(|&c| name(c)).collect();
    let pulled = names.join(", ");
    let one = names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let order = match routing {
        Some(order) => order,
        None if names.len() == 1 => &one,
        None => {
            let valid = format!("routing = [joint, …]: each of {pulled} once, from the motor outwards");
            return bad("has friction or wrap_angle, but no routing".to_owned(), &valid);
        }
    };
    let stated = [("routing", order.iter().collect::<Vec<_>>())].into_iter().chain(
        [("friction", friction), ("wrap_angle", wrap_angle)]
            .map(|(field, value)| (field, value.iter().flat_map(PerJoint::joints).collect())),
    );
    let mut sound = true;
    for (field, joints) in stated {
        for joint in joints.into_iter().filter(|joint| !names.contains(&joint.as_str())) {
            bad(format!("{field} names '{joint}', on which it does not pull"), &pulled);
            sound = false;
        }
    }
    if !sound {
        return Vec::new();
    }
    if let Some(again) = order.iter().enumerate().find(|(k, joint)| order[..*k].contains(joint)) {
        return bad(format!("routing names '{}' twice", again.1), "each joint once, from the motor outwards");
    }
    if let Some(missing) = names.iter().find(|name| !order.iter().any(|joint| joint == *name)) {
        let valid = format!("each of {pulled} once, from the motor outwards");
        return bad(format!("routing leaves out '{missing}'"), &valid);
    }
    let (friction, wrap_angle) = match (friction, wrap_angle) {
        (Some(friction), Some(wrap_angle)) => (friction, wrap_angle),
        // The way alone says nothing about friction.
        (None, None) => return Vec::new(),
        (Some(_), None) => {
            return bad("has friction, but no wrap_angle".to_owned(), "both: what counts is their product");
        }
        (None, Some(_)) => {
            return bad("has wrap_angle, but no friction".to_owned(), "both: what counts is their product");
        }
    };
    let guide = |joint: &String| {
        let coordinate = passed[names.iter().position(|name| name == joint).unwrap_or_default()];
        Guide::new(coordinate, friction.at(joint), wrap_angle.at(joint))
    };
    let guides: Vec<Guide> = order.iter().map(guide).collect();
    let sum: f64 = guides.iter().map(Guide::exponent).sum();
    if sum == 0.0 {
        return Vec::new();
    }
    if tendon.both_ways {
        return bad("has friction, and both_ways".to_owned(), "one of them: only a cable rubs on its guides");
    }
    if sum > MAX_EXPONENT {
        let valid = format!("at most {MAX_EXPONENT} along the cable; wrap_angle is in rad");
        return bad(format!("friction times wrap_angle sums up to {sum}"), &valid);
    }
    guides
}
