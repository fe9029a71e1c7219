//! `<transmission>` of type AdaptiveSynergyTransmission: the tags of adaptive synergies, R, E and rest position.
//!
//! The tags are those of CentroEPiaggio's pisa-iit-soft-hand: per joint `mechanicalReduction` (its entry of
//! R), `mechanicalElasticity` (its entry of E) and `offset` (its angle with a slack tendon and no contact).

use std::collections::BTreeSet;

use roxmltree::Node;

use crate::error::ModelError;
use crate::read::limits::Limits;
use crate::read::report::Report;

const KIND: &str = "AdaptiveSynergyTransmission";
/// A `SimpleTransmission` of a URDF.
#[derive(Clone, Debug)]
pub(crate) struct Servo {
    /// Name of the transmission.
    pub(crate) name: String,
    pub(crate) joint: String,
    pub(crate) actuator: String,
}

/// One actuator for one joint: a servo.
const SIMPLE: &str = "SimpleTransmission";

/// One tendon in a URDF.
#[derive(Clone, Debug)]
pub(crate) struct Transmission {
    pub(crate) name: String,
    /// Name of the actuator that winds it.
    pub(crate) actuator: String,
    pub(crate) joints: Vec<TransmissionJoint>,
}

#[derive(Clone, Debug)]
pub(crate) struct TransmissionJoint {
    pub(crate) joint: String,
    /// Entry of R.
    pub(crate) moment_arm: f64,
    /// Entry of E, N·m/rad.
    pub(crate) stiffness: f64,
    /// Rest angle, rad.
    pub(crate) rest: f64,
    /// Whether the file states stiffness and rest angle.
    pub(crate) stated: [bool; 2],
}

/// Reads every adaptive-synergy transmission and every servo; other types couple nothing and are reported. An invalid one is kept as
/// an error and left out.
pub(crate) fn read(
    robot: Node<'_, '_>,
    limits: &Limits,
    report: &mut Report,
) -> Result<(Vec<Transmission>, Vec<Servo>), ModelError> {
    let mut found: Vec<Transmission> = Vec::new();
    let mut servos = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("transmission")) {
        let name = node.attribute("name").unwrap_or_default().to_owned();
        let element = format!("transmission '{name}'");
        let kind = child(node, "type").and_then(|t| t.text()).unwrap_or_default().trim();
        report.limit(&element, "tendons up to here", found.len() + servos.len() + 1, limits.tendons)?;
        if kind.ends_with(SIMPLE) {
            let joints = node.children().filter(|c| c.has_tag_name("joint"));
            let joints: Vec<&str> = joints.filter_map(|joint| joint.attribute("name")).collect();
            let &[joint] = joints.as_slice() else {
                report
                    .warn(element, format!("type '{kind}' names {} joints, not one; ignored", joints.len()));
                continue;
            };
            let actuator = child(node, "actuator").and_then(|a| a.attribute("name")).unwrap_or(joint);
            let (joint, actuator) = (joint.to_owned(), actuator.to_owned());
            servos.push(Servo { name: if name.is_empty() { joint.clone() } else { name }, joint, actuator });
            continue;
        }
        if !kind.ends_with(KIND) {
            report.warn(element, format!("type '{kind}' couples no joints; ignored"));
            continue;
        }
        let known = found.iter().any(|t| t.name == name);
        let one = one(node, name, known, &element, limits, report);
        found.extend(report.keep(one));
    }
    Ok((found, servos))
}

fn one(
    node: Node<'_, '_>,
    name: String,
    known: bool,
    element: &str,
    limits: &Limits,
    report: &mut Report,
) -> Result<Transmission, ModelError> {
    if name.is_empty() || known {
        return Err(report.bad(element, "has no name of its own", "a unique name"));
    }
    let mut joints = Vec::new();
    let mut named = BTreeSet::new();
    for joint in node.children().filter(|c| c.has_tag_name("joint")) {
        let joint_name = joint.attribute("name").unwrap_or_default().to_owned();
        if !named.insert(joint_name.clone()) {
            let problem = format!("lists joint '{joint_name}' twice");
            return Err(report.bad(element, problem, "each joint once"));
        }
        let number = |tag: &str, default: f64| -> Result<f64, ModelError> {
            let Some(node) = child(joint, tag) else { return Ok(default) };
            let text = node.text().unwrap_or_default().trim();
            text.parse().ok().filter(|x: &f64| x.abs() <= limits.number).ok_or_else(|| {
                let element = format!("{element}, joint '{joint_name}'");
                report.bad(element, format!("<{tag}> is '{text}'"), "a finite number")
            })
        };
        let stiffness = number("mechanicalElasticity", 0.0)?;
        if stiffness < 0.0 {
            let element = format!("{element}, joint '{joint_name}'");
            let problem = format!("<mechanicalElasticity> is the negative stiffness {stiffness}");
            return Err(report.bad(element, problem, "a stiffness of at least 0 N·m/rad"));
        }
        joints.push(TransmissionJoint {
            moment_arm: number("mechanicalReduction", 1.0)?,
            stiffness,
            stated: [child(joint, "mechanicalElasticity").is_some(), child(joint, "offset").is_some()],
            rest: number("offset", 0.0)?,
            joint: joint_name,
        });
    }
    if joints.is_empty() {
        return Err(report.bad(element, "lists no joints", "at least one <joint name=…>"));
    }
    let mut actuators = node.children().filter(|c| c.has_tag_name("actuator"));
    let first = actuators.next();
    let actuator = first.and_then(|a| a.attribute("name")).unwrap_or(&name).to_owned();
    for more in actuators {
        let more = more.attribute("name").unwrap_or_default();
        report.warn(
            element,
            format!(
                "its second actuator '{more}' is not used: '{actuator}' alone winds it; \
                 [tendons.NAME] motors in hand.toml states several"
            ),
        );
    }
    if let Some(reduction) = first.and_then(|a| child(a, "mechanicalReduction")) {
        let text = reduction.text().unwrap_or_default().trim();
        if text.parse() != Ok(1.0) {
            report.warn(
                element,
                format!(
                    "<mechanicalReduction> {text} of actuator '{actuator}' is not used: \
                     scaling and speed_limit of the motor in hand.toml are after its gear"
                ),
            );
        }
    }
    Ok(Transmission { actuator, name, joints })
}

/// The first child element of that name.
fn child<'a, 'input>(node: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|c| c.has_tag_name(tag))
}
