//! Folds mimic joints: each joint of the URDF follows one independent coordinate.

use urdf_rs::{Joint, JointType};

use super::tree::Urdf;
use crate::error::ModelError;
use crate::read::report::Report;
use crate::read::settings::Settings;

/// Motion of a joint with the independent coordinate q: its own angle or length is x = ratio · q + offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// Index of the URDF joint that carries q.
    pub(crate) leader: usize,
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
}

/// Motion of each joint; that of a fixed joint is `None`. A joint that moves nothing is dropped and reported, unless a
/// transmission or a setting names it. The result is `None` if errors were kept.
pub(crate) fn motions(
    urdf: &Urdf,
    settings: &Settings,
    report: &mut Report,
) -> Result<Option<Vec<Option<Motion>>>, ModelError> {
    let joints = &urdf.robot.joints;
    let before = report.kept();
    let index = |name: &str| joints.iter().position(|j| j.name == name);
    let in_transmission =
        |name: &str| urdf.transmissions.iter().any(|t| t.joints.iter().any(|j| j.joint == name));
    // Files of the 2016 challenge have no <mimic>: only the names contain their couplings.
    let names_only = joints.iter().all(|j| j.mimic.is_none());

    let mut step: Vec<Option<Motion>> = Vec::new();
    for (j, joint) in joints.iter().enumerate() {
        let element = format!("joint '{}'", joint.name);
        if report.keep(moves(joint, report)) != Some(true) {
            step.push(None);
            continue;
        }
        if let Some(mimic) = &joint.mimic {
            let leader = index(&mimic.joint)
                .filter(|&l| l != j && joints[l].joint_type != JointType::Fixed)
                .ok_or_else(|| {
                    let problem = format!("mimics '{}'", mimic.joint);
                    report.bad(element, problem, "the name of another, moving joint of this file")
                });
            let (ratio, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
            step.push(report.keep(leader).map(|leader| Motion { leader, ratio, offset }));
            continue;
        }
        let named = joint.name.strip_suffix("_mimic").filter(|_| names_only).and_then(index);
        if let Some(leader) = named.filter(|&l| joints[l].joint_type != JointType::Fixed) {
            report.warn(
                element,
                format!("has no <mimic> tag; paired with '{}' by its name, one to one", joints[leader].name),
            );
            step.push(Some(Motion { leader, ratio: 1.0, offset: 0.0 }));
            continue;
        }
        let child = urdf.child_link[j];
        let carries_nothing = urdf.children[child].is_empty() && urdf.robot.links[child].collision.is_empty();
        let name = &urdf.robot.links[child].name;
        let used =
            in_transmission(&joint.name) || settings.names_joint(&joint.name) || settings.names_pin_at(name);
        if carries_nothing && !used {
            report
                .warn(element, format!("moves only link '{name}', which touches nothing; both are dropped"));
            step.push(None);
        } else {
            step.push(Some(Motion { leader: j, ratio: 1.0, offset: 0.0 }));
        }
    }

    if report.kept() > before {
        return Ok(None);
    }
    // Follows mimics of mimics to the independent joint, which leads itself.
    let mut resolved = step.clone();
    for (j, motion) in resolved.iter_mut().enumerate() {
        let Some(motion) = motion else { continue };
        let bad = |problem: &str| {
            let valid = "mimics that lead to one independent joint that moves a link";
            report.bad(format!("joint '{}'", joints[j].name), problem, valid)
        };
        for hops in 0.. {
            let next = step[motion.leader].ok_or_else(|| bad("mimics a joint that moves nothing"))?;
            if next.leader == motion.leader {
                break;
            }
            if hops > joints.len() {
                return Err(bad("mimics itself in a circle"));
            }
            *motion = Motion {
                leader: next.leader,
                ratio: motion.ratio * next.ratio,
                offset: motion.ratio * next.offset + motion.offset,
            };
        }
    }
    Ok(Some(resolved))
}

/// Whether a joint moves, or the reason why this hand cannot have it.
fn moves(joint: &Joint, report: &Report) -> Result<bool, ModelError> {
    match joint.joint_type {
        JointType::Fixed => Ok(false),
        JointType::Revolute | JointType::Continuous | JointType::Prismatic => Ok(true),
        JointType::Floating | JointType::Planar | JointType::Spherical => Err(report.bad(
            format!("joint '{}'", joint.name),
            format!("is of type {:?}", joint.joint_type),
            "fixed, revolute, continuous or prismatic",
        )),
    }
}
