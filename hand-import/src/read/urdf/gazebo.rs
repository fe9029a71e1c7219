//! `<gazebo>`: friction of links, springs of joints, mimic joints by plugin.

use roxmltree::Node;

use super::super::reading::Reading;
use crate::decision::At;
use crate::draft::{Coupling, Draft};
use crate::xml::{Element, child_text, children};

/// Elements about the look, the solver or the way to write the model.
const SILENT: [&str; 8] =
    ["material", "visual", "kp", "kd", "minDepth", "maxVel", "turnGravityOff", "preserveFixedJoint"];

/// Reads a `<gazebo>` element.
pub(super) fn gazebo(node: Node<'_, '_>, draft: &mut Draft, reading: &mut Reading<'_>) {
    let Some(reference) = node.attribute("reference") else {
        for plugin in children(node, "plugin") {
            mimic_plugin(plugin, draft, reading);
        }
        return;
    };
    let shown = format!("<gazebo reference='{reference}'>");
    let joint = draft.joints.iter_mut().find(|joint| joint.name == reference);
    let at = if joint.is_some() { At::Joint(reference.to_owned()) } else { At::Link(reference.to_owned()) };
    let mut e = Element { name: &shown, at: at.clone(), log: &mut reading.log };
    let mut number = |tag: &str| child_text(node, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let (stiffness, rest, mu) = (number("springStiffness"), number("springReference"), number("mu1"));
    match joint {
        Some(joint) => {
            if let Some(stiffness) = stiffness.filter(|k| *k > 0.0) {
                joint.stated.stiffness = joint.stated.stiffness.or(Some(stiffness));
                joint.stated.rest = joint.stated.rest.or(rest);
                let text = format!("springStiffness {stiffness}, springReference {}", rest.unwrap_or(0.0));
                reading.log.taken(at.clone(), &shown, text);
            }
        }
        None => {
            if let Some(mu) = mu.filter(|mu| (0.0..=10.0).contains(mu))
                && let Some(link) = draft.links.iter_mut().find(|link| link.name == reference)
            {
                link.friction = Some(mu);
                reading.log.taken(at.clone(), &shown, format!("mu1 {mu} is the link's friction"));
            } else if let Some(mu) = mu {
                reading.log.dropped(at.clone(), &shown, format!("mu1 {mu} is no friction of a material"));
            }
        }
    }
    const READ: [&str; 4] = ["springStiffness", "springReference", "mu1", "mu2"];
    for other in node.children().filter(Node::is_element) {
        let tag = other.tag_name().name();
        if !READ.contains(&tag) && !SILENT.contains(&tag) {
            // Once for all links.
            reading.log.dropped(At::Hand, "<gazebo>", format!("<{tag}> is for Gazebo only"));
        }
    }
}

/// Gazebo has no `<mimic>`: a widely used plugin couples two joints.
fn mimic_plugin(plugin: Node<'_, '_>, draft: &mut Draft, reading: &mut Reading<'_>) {
    let name = plugin.attribute("name").unwrap_or_default();
    let shown = format!("<plugin name='{name}'>");
    let (Some(leader), Some(joint)) = (child_text(plugin, "joint"), child_text(plugin, "mimicJoint")) else {
        reading.log.dropped(At::Hand, shown, "is for Gazebo only");
        return;
    };
    if draft.couplings.iter().any(|coupling| coupling.joint == joint) {
        return;
    }
    let at = At::Joint(joint.to_owned());
    let mut e = Element { name: &shown, at: at.clone(), log: &mut reading.log };
    let mut number = |tag: &str| child_text(plugin, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let (multiplier, offset) = (number("multiplier").unwrap_or(1.0), number("offset").unwrap_or(0.0));
    reading.log.taken(at, shown, format!("follows '{leader}': multiplier {multiplier}, offset {offset}"));
    let (joint, leader) = (joint.to_owned(), leader.to_owned());
    draft.couplings.push(Coupling { joint, leader, coefficients: vec![offset, multiplier] });
}
