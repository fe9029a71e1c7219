//! `<dof>`: a motor, and the transmission between it and its joints.
//!
//! | type | transmission |
//! |---|---|
//! | `r` | rigid: the joints keep their proportion |
//! | `b` | a clutch in each joint but the last: at `breakAwayTorque` it lets go and keeps the joint, and the others go on |
//! | `c` | compliant: one cable over all joints, against their springs |

use palmares_models::hand::StatedTendon;
use roxmltree::Node;

use super::chain::Moved;
use super::units::{FORCE, MM, TORQUE};
use crate::decision::At;
use crate::draft::{Actuator, Control, Coupling, Draft, Drive, JointKind, Tendon, TendonPath};
use crate::read::reading::Reading;
use crate::xml::{Element, child_text};

/// Moment arm of a compliant degree of freedom at a joint with the factor 1, m: GraspIt! has it as a constant.
const ARM: f64 = 0.04;
/// Torque that a joint behind a clutch holds, over that at which the clutch lets go. GraspIt! has no limit.
const HOLD: f64 = 10.0;

/// The figures of a degree of freedom, in SI units.
struct Dof {
    name: String,
    element: String,
    effort: Option<f64>,
    /// Force per error of position, of the degree of freedom's value.
    gain: Option<f64>,
    damping: Option<f64>,
}

/// Adds a motor with its transmission.
pub(super) fn dof(
    node: Node<'_, '_>,
    d: usize,
    joints: &[Moved],
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let name = format!("d{d}");
    let element = format!("dof {d}");
    let Some(first) = joints.first() else {
        reading.log.dropped(At::Hand, element, "moves no joint; it is left out");
        return;
    };
    let at = At::Motor(name.clone());
    let leader = draft.joints.iter().find(|joint| joint.name == first.joint);
    let slides = leader.is_some_and(|joint| joint.kind == JointKind::Prismatic);
    let (force, gain) = if slides { (FORCE, FORCE / MM) } else { (TORQUE, TORQUE) };
    let mut e = Element { name: &element, at: at.clone(), log: &mut reading.log };
    let mut number = |tag: &str| child_text(node, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let effort = number("maxEffort");
    let breakaway = number("breakAwayTorque").filter(|torque| *torque > 0.0);
    let start = number("defaultValue").map(f64::to_radians);
    let kind = node.attribute("type").unwrap_or("r").trim();
    let of_force = |scale: f64| effort.map(|x| x * scale);
    let dof = Dof {
        gain: number("Kp").map(|x| x * gain),
        damping: number("Kd").map(|x| x * gain),
        effort: of_force(if kind == "c" { FORCE } else { force }),
        name,
        element,
    };
    let range = range(joints, draft);
    if let Some(start) = start.filter(|x| *x != 0.0) {
        let [low, high] = range.unwrap_or([start; 2]);
        for moved in if kind == "r" { &joints[..1] } else { joints } {
            draft.start.joints.push((moved.joint.clone(), moved.factor * start.clamp(low, high)));
        }
    }
    match (kind, breakaway) {
        ("b", Some(torque)) if joints.len() > 1 => clutches(&dof, torque, range, joints, draft, reading),
        ("c", _) if sprung(&dof, joints, draft, reading) => cable(&dof, joints, draft, reading),
        ("r" | "" | "c", _) => rigid(&dof, joints, draft, reading),
        ("b", torque) => {
            let text = match torque {
                Some(_) => "has a clutch, but only one joint",
                None => "has a clutch without a breakAwayTorque; its joints stay coupled",
            };
            reading.log.dropped(at, &dof.element, text);
            rigid(&dof, joints, draft, reading);
        }
        (other, _) => {
            reading.log.problem(at, &dof.element, format!("is of the unknown type '{other}'; taken is r"));
            rigid(&dof, joints, draft, reading);
        }
    }
}

/// The values at which all joints are within their limits.
fn range(joints: &[Moved], draft: &Draft) -> Option<[f64; 2]> {
    let of_joint = |moved: &Moved| {
        let [a, b] = draft.joints.iter().find(|joint| joint.name == moved.joint)?.limits?;
        let (a, b) = (a / moved.factor, b / moved.factor);
        Some([a.min(b), a.max(b)])
    };
    let both = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.max(c), b.min(d)];
    joints.iter().filter_map(of_joint).reduce(both).filter(|[low, high]| low < high)
}

/// The first joint carries the motor; the others follow it.
fn rigid(dof: &Dof, joints: &[Moved], draft: &mut Draft, reading: &mut Reading<'_>) {
    let (leader, factor) = (&joints[0].joint, joints[0].factor);
    for follower in &joints[1..] {
        draft.couplings.push(Coupling {
            joint: follower.joint.clone(),
            leader: leader.clone(),
            coefficients: vec![0.0, follower.factor / factor],
        });
    }
    if factor != 1.0 {
        let text = format!("its motor is on joint '{leader}', which it turns by {factor}");
        reading.log.taken(At::Motor(dof.name.clone()), &dof.element, text);
    }
    draft.actuators.push(Actuator {
        control: Some(Control::Position),
        gain: dof.gain.map(|k| k / factor.abs()),
        damping: dof.damping.map(|b| b / factor.abs()),
        force_limit: dof.effort,
        ..Actuator::of(&dof.name, Drive::Joint(leader.clone()))
    });
}

/// A drive for each joint, wound by the one motor. All but the last one have a clutch.
fn clutches(
    dof: &Dof,
    torque: f64,
    range: Option<[f64; 2]>,
    joints: &[Moved],
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    for (k, moved) in joints.iter().enumerate() {
        let clutch = k + 1 < joints.len();
        draft.tendons.push(Tendon {
            // A positive length closes, so that the clutch lets go in this direction.
            joints: vec![(moved.joint.clone(), TendonPath::Arm(moved.factor.signum()))],
            motors: vec![(dof.name.clone(), moved.factor.abs())],
            stated: StatedTendon {
                stiffness: dof.gain,
                damping: dof.damping,
                force_limit: if clutch { Some(torque) } else { dof.effort.map(|effort| effort.max(torque)) },
                both_ways: Some(true),
                hold_limit: clutch.then_some(HOLD * torque),
                breakaway: Some(clutch),
                ..StatedTendon::default()
            },
            ..Tendon::of(&moved.joint)
        });
    }
    let (at, last) = (At::Motor(dof.name.clone()), &joints[joints.len() - 1].joint);
    let text = format!(
        "has a breakaway clutch of {torque} N·m in each joint but '{last}': a joint that is stopped stays, the others go on"
    );
    reading.log.taken(at.clone(), &dof.element, text);
    let text = format!("a joint behind its clutch holds {} N·m; GraspIt! states no limit", HOLD * torque);
    reading.log.guessed(at, &dof.element, text);
    draft.actuators.push(Actuator {
        control: Some(Control::Position),
        range,
        ..Actuator::of(&dof.name, Drive::Tendon(joints[0].joint.clone()))
    });
}

/// Whether the joints have springs. One without has that of the first.
fn sprung(dof: &Dof, joints: &[Moved], draft: &mut Draft, reading: &mut Reading<'_>) -> bool {
    let at = At::Motor(dof.name.clone());
    let mut first = None;
    for moved in joints {
        let Some(joint) = draft.joints.iter_mut().find(|joint| joint.name == moved.joint) else { continue };
        match (joint.stated.stiffness, first) {
            (Some(stiffness), None) => first = Some(stiffness),
            (Some(_), Some(_)) => {}
            (None, Some(stiffness)) => {
                joint.stated.stiffness = Some(stiffness);
                let text = format!("joint '{}' has no spring; taken is that of the first", moved.joint);
                reading.log.guessed(at.clone(), &dof.element, text);
            }
            (None, None) => {
                let text = format!(
                    "is compliant, but joint '{}' has no spring; its joints stay coupled",
                    moved.joint
                );
                reading.log.problem(at, &dof.element, text);
                return false;
            }
        }
    }
    first.is_some()
}

/// One cable over all joints. GraspIt! turns the link behind each joint by `force · 40 mm · factor`, so that a joint also
/// carries the torques of those behind it.
fn cable(dof: &Dof, joints: &[Moved], draft: &mut Draft, reading: &mut Reading<'_>) {
    let arm = |k: usize| -> f64 {
        let own = &joints[k];
        let behind = joints[k..].iter().filter(|other| other.chain == own.chain);
        ARM * behind.map(|other| other.factor * own.axis.dot(other.axis)).sum::<f64>()
    };
    // Parallel axes give whole factors.
    let rounded = |r: f64| (r * 1e12).round() * 1e-12;
    let arms: Vec<(String, TendonPath)> =
        (0..joints.len()).map(|k| (joints[k].joint.clone(), TendonPath::Arm(rounded(arm(k))))).collect();
    let text = format!(
        "is compliant: one cable over {} joints against their springs, with GraspIt!'s moment arm of {ARM} m",
        joints.len()
    );
    reading.log.taken(At::Motor(dof.name.clone()), &dof.element, text);
    draft.tendons.push(Tendon {
        joints: arms,
        motors: vec![(dof.name.clone(), 1.0)],
        stated: StatedTendon { force_limit: dof.effort, ..StatedTendon::default() },
        ..Tendon::of(&dof.name)
    });
    draft.actuators.push(Actuator::of(&dof.name, Drive::Tendon(dof.name.clone())));
}
