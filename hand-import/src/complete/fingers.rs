//! Fingers whose joints have a servo each: hinges in a row, with axes in one direction, up to a last link.

use palmares_models::Vec3;

use super::motors::Wound;
use super::servos::Servo;
use crate::draft::{Draft, Joint, JointKind};

/// Two axes have one direction if the cosine of their angle is at least this: 5°.
const PARALLEL: f64 = 0.996;

/// The joints of one finger, from the palm outwards.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finger<'a> {
    pub(crate) joints: Vec<&'a Joint>,
}

/// The fingers of a hand; none if there are fewer than two, such as those of an arm.
pub(crate) fn fingers<'a>(draft: &'a Draft, servos: &[Servo], tendons: &[Wound]) -> Vec<Finger<'a>> {
    if draft.settings.is_some() || !draft.springs.is_empty() || !tendons.is_empty() {
        return Vec::new();
    }
    let plain = |joint: &Joint| {
        let coupled = draft.couplings.iter().any(|c| c.joint == joint.name || c.leader == joint.name);
        let servo = servos.iter().any(|servo| servo.joint == joint.name);
        joint.kind == JointKind::Revolute
            && joint.limits.is_some()
            && joint.stated.stiffness.is_none()
            && servo
            && !coupled
    };
    // The row of a finger goes on where the only joint behind one turns in the same direction.
    let goes_on = |before: &Joint, joint: &Joint| {
        let parallel = axis_before(draft, before, joint)
            .is_some_and(|axis| axis.dot(Vec3::from_array(before.axis).normalize()).abs() >= PARALLEL);
        plain(before) && plain(joint) && parallel && behind(draft, before).len() == 1
    };
    let first = |joint: &&Joint| {
        plain(joint) && !moving_before(draft, joint).is_some_and(|before| goes_on(before, joint))
    };
    let mut found = Vec::new();
    for first in draft.joints.iter().filter(first) {
        let mut joints = vec![first];
        let whole = loop {
            let last = joints[joints.len() - 1];
            match behind(draft, last).as_slice() {
                [] => break true,
                [next] if goes_on(last, next) => joints.push(next),
                _ => break false,
            }
        };
        if whole && joints.len() > 1 {
            found.push(Finger { joints });
        }
    }
    if found.len() > 1 { found } else { Vec::new() }
}

/// The nearest joint that moves, towards the base.
fn moving_before<'a>(draft: &'a Draft, joint: &Joint) -> Option<&'a Joint> {
    let before = draft.joints.iter().find(|other| other.child == joint.parent)?;
    if before.kind == JointKind::Fixed { moving_before(draft, before) } else { Some(before) }
}

/// The nearest joints that move, away from the base.
fn behind<'a>(draft: &'a Draft, joint: &Joint) -> Vec<&'a Joint> {
    let next = draft.joints.iter().filter(|other| other.parent == joint.child);
    next.flat_map(|other| if other.kind == JointKind::Fixed { behind(draft, other) } else { vec![other] })
        .collect()
}

/// The axis of a joint in the frame of an earlier one, between which all joints are fixed.
fn axis_before(draft: &Draft, before: &Joint, joint: &Joint) -> Option<Vec3> {
    let mut axis = joint.origin.pose().rotation * Vec3::from_array(joint.axis).normalize();
    let mut link = &joint.parent;
    while *link != before.child {
        let fixed = draft.joints.iter().find(|other| other.child == *link)?;
        axis = fixed.origin.pose().rotation * axis;
        link = &fixed.parent;
    }
    Some(axis)
}
