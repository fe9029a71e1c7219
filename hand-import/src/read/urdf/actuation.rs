//! Motors and tendons: `<transmission>` of ros_control and of the Pisa/IIT SoftHand, `<ros2_control>`.

use roxmltree::Node;

use super::super::reading::Reading;
use crate::decision::{At, Log};
use crate::draft::{Actuator, Control, Draft, Drive, Tendon, TendonPath};
use crate::xml::{Element, child, child_text, children};

/// Reads a `<transmission>`.
pub(super) fn transmission(node: Node<'_, '_>, draft: &mut Draft, reading: &mut Reading<'_>) {
    let name = node.attribute("name").unwrap_or_default().to_owned();
    let shown = format!("transmission '{name}'");
    // The first generation of ros_control had the type as an attribute.
    let kind = child_text(node, "type").or(node.attribute("type")).unwrap_or_default();
    let kind = kind.rsplit('/').next().unwrap_or_default();
    match kind {
        "AdaptiveSynergyTransmission" => adaptive_synergy(node, &name, &shown, draft, reading),
        "SimpleTransmission" => simple(node, &name, &shown, draft, reading),
        "DifferentialTransmission" | "FourBarLinkageTransmission" => {
            let text = "each joint has a motor of its own: motors that hold their positions move them alike";
            each(node, &name, &shown, text, draft, reading);
        }
        // Makers have types of their own.
        _ => {
            // Once for all transmissions of the type.
            let element = format!("transmissions of type '{kind}'");
            let text = "are not known; each joint of them that follows no other has one motor";
            each(node, &name, &element, text, draft, reading);
        }
    }
}

/// One motor for each joint of a transmission with a law of its own.
fn each(
    node: Node<'_, '_>,
    name: &str,
    shown: &str,
    text: &str,
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let joints: Vec<&str> = children(node, "joint").filter_map(|joint| joint.attribute("name")).collect();
    if joints.is_empty() {
        let element = format!("transmission '{name}'");
        reading.log.problem(At::Hand, element, "names no <joint>; it is left out");
        return;
    }
    let actuators: Vec<&str> =
        children(node, "actuator").filter_map(|actuator| actuator.attribute("name")).collect();
    reading.log.guessed(At::Hand, shown, text);
    let follows = |joint: &str| draft.couplings.iter().any(|coupling| coupling.joint == joint);
    let own: Vec<bool> = joints.iter().map(|joint| !follows(joint)).collect();
    for (k, joint) in joints.iter().enumerate().filter(|(k, _)| own[*k]) {
        let motor = actuators.get(k).copied().unwrap_or(if joints.len() == 1 { name } else { joint });
        let interface = child_text(node, "hardwareInterface").and_then(control);
        add(draft, Actuator { control: interface, ..Actuator::of(motor, Drive::Joint((*joint).to_owned())) });
    }
}

/// The tags of CentroEPiaggio's pisa-iit-soft-hand: each joint has its entry of R, of E and its rest position.
fn adaptive_synergy(
    node: Node<'_, '_>,
    name: &str,
    shown: &str,
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let mut e = Element { name: shown, at: At::Tendon(name.to_owned()), log: &mut reading.log };
    let mut number = |node: Node<'_, '_>, tag: &str| {
        child_text(node, tag).and_then(|text| e.number(&format!("<{tag}>"), text))
    };
    let mut joints = Vec::new();
    let mut springs = Vec::new();
    for joint in children(node, "joint") {
        let joint_name = joint.attribute("name").unwrap_or_default().to_owned();
        joints
            .push((joint_name.clone(), TendonPath::Arm(number(joint, "mechanicalReduction").unwrap_or(1.0))));
        springs.push((joint_name, number(joint, "mechanicalElasticity"), number(joint, "offset")));
    }
    let actuators: Vec<Node<'_, '_>> = children(node, "actuator").collect();
    let mut motors = Vec::new();
    for actuator in &actuators {
        let reduction = number(*actuator, "mechanicalReduction").unwrap_or(1.0);
        let motor = actuator.attribute("name").unwrap_or(name).to_owned();
        motors.push((motor.clone(), 1.0));
        add(draft, Actuator { gear: reduction, ..Actuator::of(&motor, Drive::Tendon(name.to_owned())) });
    }
    if actuators.is_empty() {
        motors.push((name.to_owned(), 1.0));
        add(draft, Actuator::of(name, Drive::Tendon(name.to_owned())));
    }
    for (joint, stiffness, rest) in springs {
        spring(&joint, stiffness, rest, shown, draft, &mut reading.log);
    }
    draft.tendons.push(Tendon { joints, motors, ..Tendon::of(name) });
}

/// Gives a joint the spring that a transmission states, unless another one states another.
fn spring(
    joint: &str,
    stiffness: Option<f64>,
    rest: Option<f64>,
    shown: &str,
    draft: &mut Draft,
    log: &mut Log,
) {
    let Some(joint) = draft.joints.iter_mut().find(|other| other.name == joint) else {
        log.problem(At::Hand, shown, format!("names joint '{joint}', which is not there"));
        return;
    };
    for (stated, new, what) in [
        (&mut joint.stated.stiffness, stiffness, "mechanicalElasticity"),
        (&mut joint.stated.rest, rest, "offset"),
    ] {
        match (*stated, new) {
            (Some(first), Some(second)) if first != second => {
                let text = format!(
                    "<{what}> is {second} here and {first} in another transmission; taken is {first}"
                );
                log.problem(At::Joint(joint.name.clone()), format!("{shown}, joint '{}'", joint.name), text);
            }
            (None, Some(_)) => *stated = new,
            _ => {}
        }
    }
}

/// One motor a joint.
fn simple(node: Node<'_, '_>, name: &str, shown: &str, draft: &mut Draft, reading: &mut Reading<'_>) {
    let joints: Vec<Node<'_, '_>> = children(node, "joint").collect();
    let &[joint] = joints.as_slice() else {
        let text = format!("has {} joints, a SimpleTransmission has one; it is left out", joints.len());
        reading.log.problem(At::Hand, shown, text);
        return;
    };
    let joint_name = joint.attribute("name").unwrap_or_default().to_owned();
    let actuator = child(node, "actuator");
    for other in children(node, "actuator").skip(1) {
        let other = other.attribute("name").unwrap_or_default();
        let text = format!("its second actuator '{other}' is left out: a SimpleTransmission has one");
        reading.log.dropped(At::Motor(name.to_owned()), shown, text);
    }
    let interface = |node| child_text(node, "hardwareInterface").and_then(control);
    let mut e = Element { name: shown, at: At::Motor(name.to_owned()), log: &mut reading.log };
    let reduction = actuator.and_then(|actuator| child_text(actuator, "mechanicalReduction"));
    let gear = reduction.and_then(|text| e.number("<mechanicalReduction>", text)).unwrap_or(1.0);
    let motor = actuator.and_then(|actuator| actuator.attribute("name")).unwrap_or(name).to_owned();
    if gear != 1.0 {
        let text = format!(
            "mechanicalReduction {gear}: effort and velocity of the joint's <limit> count after the gear"
        );
        reading.log.taken(At::Motor(motor.clone()), shown, text);
    }
    let control = interface(joint).or_else(|| actuator.and_then(interface));
    add(draft, Actuator { gear, control, ..Actuator::of(&motor, Drive::Joint(joint_name)) });
}

/// Reads a `<ros2_control>`: a joint with a command interface has a motor.
pub(super) fn ros2_control(node: Node<'_, '_>, draft: &mut Draft, reading: &mut Reading<'_>) {
    for joint in children(node, "joint") {
        let name = joint.attribute("name").unwrap_or_default().to_owned();
        let shown = format!("<ros2_control>, joint '{name}'");
        let Some(command) = child(joint, "command_interface") else { continue };
        let mimics = children(joint, "param").any(|param| param.attribute("name") == Some("mimic"));
        if mimics || draft.couplings.iter().any(|coupling| coupling.joint == name) {
            reading.log.dropped(
                At::Joint(name),
                shown,
                "the joint follows another one, so that it has no motor",
            );
            continue;
        }
        let control = command.attribute("name").and_then(control);
        let mut e = Element { name: &shown, at: At::Motor(name.clone()), log: &mut reading.log };
        let mut limit = |name: &str| {
            let param = children(command, "param").find(|param| param.attribute("name") == Some(name))?;
            e.number(name, param.text()?)
        };
        let range = limit("min").zip(limit("max")).map(|(low, high)| [low, high]);
        add(draft, Actuator { control, range, ..Actuator::of(&name, Drive::Joint(name.clone())) });
    }
    for tag in ["gpio", "sensor"] {
        if child(node, tag).is_some() {
            reading.log.dropped(At::Hand, "<ros2_control>", format!("<{tag}> is for the real hand's driver"));
        }
    }
}

/// Adds a motor, unless the joint or tendon has that one already: hands list one transmission for each interface.
fn add(draft: &mut Draft, actuator: Actuator) {
    let again = |other: &Actuator| {
        other.drive == actuator.drive
            && (other.name == actuator.name || matches!(other.drive, Drive::Joint(_)))
    };
    if !draft.actuators.iter().any(again) {
        draft.actuators.push(actuator);
    }
}

fn control(interface: &str) -> Option<Control> {
    let interface = interface.rsplit('/').next().unwrap_or_default().to_lowercase();
    [("position", Control::Position), ("velocity", Control::Velocity), ("effort", Control::Force)]
        .into_iter()
        .find_map(|(word, control)| interface.contains(word).then_some(control))
}
