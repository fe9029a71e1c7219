//! The chain of joints from the root of a URDF to one of its links, as an arm.

use std::path::Path;

use urdf_rs::JointType;

use super::files::Files;
use super::limits::Limits;
use super::report::Report;
use super::urdf::tree::{self, Urdf, pose};
use crate::arm::{Arm, ArmJoint};
use crate::error::ModelError;
use crate::{Pose, Vec3};

/// Most joints of an arm that move.
const MAX_JOINTS: usize = 16;

/// Reads the arm in a URDF of `files`, from its root to the link `tip`; without `tip`, to the end of its only chain. It ignores masses, meshes
/// and other chains. `element` is the field that names the file.
///
/// # Errors
/// The file, the joint or link, and what would be valid.
pub fn arm(urdf: &str, tip: Option<&str>, files: &Files, element: &str) -> Result<Arm, ModelError> {
    let limits = Limits::default();
    let relative = Path::new(urdf);
    let bytes = files.read(relative, element, limits.text_bytes)?;
    let mut report = Report::new(&files.display(relative));
    let text = String::from_utf8(bytes).map_err(|e| report.syntax("UTF-8", e))?;
    let tree = tree::parse(&text, &limits, &mut report)?;
    let tree = tree.filter(|_| report.kept() == 0).ok_or_else(|| report.refusal())?;
    let end = tip_of(&tree, tip, &report)?;
    let mut chain = Vec::new();
    let mut link = end;
    while let Some(joint) = (0..tree.child_link.len()).find(|&joint| tree.child_link[joint] == link) {
        chain.push(joint);
        let parent = &tree.robot.joints[joint].parent.link;
        // The tree has checked that it is there.
        link = tree.robot.links.iter().position(|known| known.name == *parent).unwrap_or(tree.root);
    }
    let (mut joints, mut behind) = (Vec::new(), Pose::IDENTITY);
    for joint in chain.into_iter().rev().map(|joint| &tree.robot.joints[joint]) {
        behind *= pose(&joint.origin);
        if joint.joint_type != JointType::Fixed {
            let before = std::mem::replace(&mut behind, Pose::IDENTITY);
            joints.push(read_joint(joint, before, &report)?);
        }
    }
    if joints.is_empty() {
        let problem = format!("no joint between its root and link '{}' moves", tree.robot.links[end].name);
        return Err(report.bad("robot", problem, "an arm with revolute, continuous or prismatic joints"));
    }
    report.limit("robot", "joints of an arm", joints.len(), MAX_JOINTS)?;
    let name = tree.robot.name;
    Ok(Arm { name, world_from_root: Pose::IDENTITY, joints, last_from_base: behind })
}

/// The link at the end of the chain.
fn tip_of(tree: &Urdf, tip: Option<&str>, report: &Report) -> Result<usize, ModelError> {
    let links = &tree.robot.links;
    if let Some(tip) = tip {
        return links.iter().position(|link| link.name == tip).ok_or_else(|| {
            let names: Vec<&str> = links.iter().map(|link| link.name.as_str()).collect();
            report.bad("robot", format!("has no link '{tip}'"), format!("tip = one of {}", names.join(", ")))
        });
    }
    let ends: Vec<usize> = (0..links.len()).filter(|&link| tree.children[link].is_empty()).collect();
    match ends.as_slice() {
        [end] => Ok(*end),
        _ => {
            let names: Vec<&str> = ends.iter().map(|&end| links[end].name.as_str()).collect();
            let problem = format!("ends in {} links: {}", ends.len(), names.join(", "));
            Err(report.bad("robot", problem, "tip = the link that carries the hand"))
        }
    }
}

fn read_joint(joint: &urdf_rs::Joint, before: Pose, report: &Report) -> Result<ArmJoint, ModelError> {
    let element = format!("joint '{}'", joint.name);
    let turns = match joint.joint_type {
        JointType::Revolute | JointType::Continuous => true,
        JointType::Prismatic => false,
        _ => {
            let valid = "revolute, continuous, prismatic or fixed joints in an arm";
            return Err(report.bad(element, "has a type that an arm cannot have", valid));
        }
    };
    if joint.mimic.is_some() {
        return Err(report.bad(element, "mimics another joint", "an arm whose joints move by themselves"));
    }
    let axis = Vec3::from_array(*joint.axis.xyz);
    let length = axis.length();
    if !(length.is_finite() && length > 1e-9) {
        return Err(report.bad(element, "has an axis of no direction", "a unit vector"));
    }
    let (lower, upper) = match joint.joint_type {
        JointType::Continuous => (f64::NEG_INFINITY, f64::INFINITY),
        _ => (joint.limit.lower, joint.limit.upper),
    };
    if lower >= upper {
        let problem = format!("has the range {lower} to {upper}");
        return Err(report.bad(element, problem, "<limit lower upper>, rad or m, the lower one less"));
    }
    let speed = joint.limit.velocity;
    if !(speed.is_finite() && speed > 0.0) {
        let problem = format!("has the largest speed {speed}");
        return Err(report.bad(element, problem, "<limit velocity> of more than 0, rad/s or m/s"));
    }
    Ok(ArmJoint { name: joint.name.clone(), turns, before, axis: axis / length, lower, upper, speed })
}
