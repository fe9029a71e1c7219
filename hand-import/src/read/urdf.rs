//! URDF, with the extensions that published hands have: transmissions of ros_control, `ros2_control`, `gazebo`.

mod actuation;
mod elements;
mod gazebo;
mod links;

use std::collections::BTreeSet;
use std::rc::Rc;

use roxmltree::Node;

use self::elements::{named, unread};
use super::reading::{Reading, settings};
use crate::decision::At;
use crate::draft::{Coupling, Draft, Joint, JointKind};
use crate::error::ImportError;
use crate::glance::Glance;
use crate::xml::{Element, child, children};

/// Elements of a robot that only change its look or belong to other programs.
const SILENT: [&str; 2] = ["material", "comment"];

/// Whether a file is URDF, whose macros are expanded.
pub(super) fn is(file: &Glance<'_>) -> bool {
    file.root == "robot" && file.text.contains("<link") && !file.text.contains("<xacro:")
}

/// Reads a URDF.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let text = Rc::clone(&reading.text);
    let document = reading.xml(&text)?;
    let robot = document.root_element();
    let mut draft = Draft {
        name: robot.attribute("name").unwrap_or("hand").to_owned(),
        settings: settings(reading)?,
        ..Draft::default()
    };
    let mut unknown = BTreeSet::new();
    for node in robot.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => {
                let link = links::link(node, reading);
                draft.links.push(link);
            }
            "joint" => joint(node, &mut draft, reading),
            // After links and joints, which they name.
            "transmission" | "ros2_control" | "gazebo" => {}
            silent if SILENT.contains(&silent) => {}
            other => {
                unknown.insert(other.to_owned());
            }
        }
    }
    for node in robot.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "transmission" => actuation::transmission(node, &mut draft, reading),
            "ros2_control" => actuation::ros2_control(node, &mut draft, reading),
            "gazebo" => gazebo::gazebo(node, &mut draft, reading),
            _ => {}
        }
    }
    for name in unknown {
        reading.log.dropped(At::Hand, format!("<{name}>"), "is no element of URDF");
    }
    pair_by_name(&mut draft, reading);
    floating(&draft, robot, reading);
    Ok(draft)
}

/// Joints of all six degrees of freedom: one between the world and the base is what the controller's arm does.
fn floating(draft: &Draft, robot: Node<'_, '_>, reading: &mut Reading<'_>) {
    for node in children(robot, "joint").filter(|node| node.attribute("type") == Some("floating")) {
        let name = node.attribute("name").unwrap_or_default();
        let Some(joint) = draft.joints.iter().find(|joint| joint.name == name) else { continue };
        let (at, element) = (At::Joint(name.to_owned()), format!("joint '{name}'"));
        let below = draft.joints.iter().any(|other| other.child == joint.parent);
        if below {
            let text = "is floating, which a joint of a hand cannot be; taken is a fixed joint";
            reading.log.problem(at, element, text);
        } else {
            let text =
                "is floating: the base of a hand moves with the controller's arm; taken is a fixed joint";
            reading.log.taken(at, element, text);
        }
    }
}

fn joint(node: Node<'_, '_>, draft: &mut Draft, reading: &mut Reading<'_>) {
    const READ: [&str; 9] = [
        "origin",
        "parent",
        "child",
        "axis",
        "limit",
        "dynamics",
        "mimic",
        "safety_controller",
        "calibration",
    ];
    let name = named(node, reading);
    unread(node, &READ, "joint", reading);
    let shown = format!("joint '{name}'");
    let at = At::Joint(name.clone());
    let link = |tag: &str| child(node, tag).and_then(|n| n.attribute("link")).unwrap_or_default().to_owned();
    let kind = match node.attribute("type").unwrap_or_default() {
        "fixed" => JointKind::Fixed,
        "revolute" => JointKind::Revolute,
        "continuous" => JointKind::Continuous,
        "prismatic" => JointKind::Prismatic,
        "spherical" | "ball" => JointKind::Ball,
        "floating" => JointKind::Fixed,
        other => {
            let valid = "fixed, revolute, continuous, prismatic, spherical";
            let problem = format!(
                "is of type '{other}', which a hand does not have; valid: {valid}; taken is a fixed joint"
            );
            reading.log.problem(at.clone(), &shown, problem);
            JointKind::Fixed
        }
    };
    let mut joint = Joint { kind, ..Joint::fixed(&name, link("parent"), link("child")) };
    let mut e = Element { name: &shown, at: at.clone(), log: &mut reading.log };
    if let Some(origin) = child(node, "origin") {
        joint.origin = links::origin(origin, &mut e);
    }
    // The default of URDF.
    joint.axis = child(node, "axis").and_then(|axis| e.numbers(axis, "xyz")).unwrap_or([1.0, 0.0, 0.0]);
    if let Some(limit) = child(node, "limit") {
        let (lower, upper) = (e.attribute(limit, "lower"), e.attribute(limit, "upper"));
        // URDF has no limits of a continuous joint, and many files state 0 and 0.
        if kind != JointKind::Continuous && (lower.is_some() || upper.is_some()) {
            joint.limits = Some([lower.unwrap_or(0.0), upper.unwrap_or(0.0)]);
        }
        joint.effort = e.attribute(limit, "effort");
        joint.velocity = e.attribute(limit, "velocity");
    }
    if let Some(dynamics) = child(node, "dynamics") {
        joint.stated.damping = e.attribute(dynamics, "damping");
        joint.stated.friction = e.attribute(dynamics, "friction");
    }
    if let Some(mimic) = child(node, "mimic") {
        let multiplier = e.attribute(mimic, "multiplier").unwrap_or(1.0);
        let offset = e.attribute(mimic, "offset").unwrap_or(0.0);
        let leader = mimic.attribute("joint").unwrap_or_default().to_owned();
        draft.couplings.push(Coupling { joint: name, leader, coefficients: vec![offset, multiplier] });
    }
    for tag in ["safety_controller", "calibration"] {
        if child(node, tag).is_some() {
            reading.log.dropped(at.clone(), &shown, format!("<{tag}> is for the real hand's driver"));
        }
    }
    draft.joints.push(joint);
}

/// Files of the 2016 challenge have no `<mimic>`: only the names contain their couplings.
fn pair_by_name(draft: &mut Draft, reading: &mut Reading<'_>) {
    if !draft.couplings.is_empty() {
        return;
    }
    for joint in draft.joints.iter().filter(|joint| joint.kind != JointKind::Fixed) {
        let Some(leader) = joint.name.strip_suffix("_mimic") else { continue };
        if draft.joints.iter().any(|other| other.name == leader && other.kind != JointKind::Fixed) {
            let text = format!("has no <mimic>; it follows '{leader}', one to one, by its name");
            reading.log.guessed(At::Joint(joint.name.clone()), format!("joint '{}'", joint.name), text);
            let (joint, leader) = (joint.name.clone(), leader.to_owned());
            draft.couplings.push(Coupling { joint, leader, coefficients: vec![0.0, 1.0] });
        }
    }
}
