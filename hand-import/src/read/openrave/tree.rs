//! Makes links and joints of bodies and hinges: a link's frame is where its joint is.

use std::collections::BTreeMap;

use palmares_models::Pose;

use super::super::reading::Reading;
use super::model::{Hinge, Model};
use crate::decision::At;
use crate::draft::{Actuator, Coupling, Draft, Drive, Inertial, Joint, JointKind, Link, LinkShape, Origin};

/// The joint that leads to a body.
struct Lead<'a> {
    hinge: &'a Hinge,
    parent: usize,
    /// −1 if the body is the joint's first one: it then moves against the axis.
    sign: f64,
}

pub(super) fn links_and_joints(model: Model, draft: &mut Draft, reading: &mut Reading<'_>) {
    let leads = leads(&model, reading);
    let frames: Vec<Pose> = model
        .bodies
        .iter()
        .enumerate()
        .map(|(k, body)| {
            let anchor = leads.get(&k).filter(|lead| lead.hinge.kind != JointKind::Prismatic);
            Pose::from_parts(
                anchor.map_or(body.pose.translation, |lead| lead.hinge.anchor),
                body.pose.rotation,
            )
        })
        .collect();
    for (body, frame) in model.bodies.iter().zip(&frames) {
        let link_from_body = frame.inverse() * body.pose;
        let inertial = body.mass.map(|stated| {
            let m = stated.inertia;
            let com = Pose::from_parts(link_from_body * stated.com, link_from_body.rotation);
            Inertial {
                origin: Origin::from_pose(&com),
                mass: stated.mass,
                inertia: [m.x_axis.x, m.x_axis.y, m.x_axis.z, m.y_axis.y, m.y_axis.z, m.z_axis.z],
            }
        });
        let mut link = Link { name: body.name.clone(), inertial, ..Link::default() };
        for shape in &body.shapes {
            let origin = Origin::from_pose(&(link_from_body * shape.pose));
            let part = LinkShape { origin, geometry: shape.geometry.clone() };
            if shape.touches {
                link.collisions.push(part);
            } else {
                link.visuals.push(part);
            }
        }
        draft.links.push(link);
    }
    for (&k, lead) in &leads {
        let Hinge { name, kind, limits, velocity, effort, .. } = lead.hinge;
        let fixed = Joint::fixed(name, &model.bodies[lead.parent].name, &model.bodies[k].name);
        let axis = model.bodies[k].pose.rotation.inverse() * (lead.hinge.axis * lead.sign);
        draft.joints.push(Joint {
            kind: *kind,
            origin: Origin::from_pose(&(frames[lead.parent].inverse() * frames[k])),
            axis: axis.to_array(),
            limits: *limits,
            velocity: *velocity,
            effort: *effort,
            ..fixed
        });
        let moves = *kind != JointKind::Fixed;
        if let Some((leader, coefficients)) = lead.hinge.follows.as_ref().filter(|_| moves) {
            draft.couplings.push(Coupling {
                joint: name.clone(),
                leader: leader.clone(),
                coefficients: coefficients.to_vec(),
            });
        } else if lead.hinge.active && moves && *kind != JointKind::Ball {
            draft.actuators.push(Actuator::of(name, Drive::Joint(name.clone())));
        }
    }
    if !draft.actuators.is_empty() {
        let text = format!("each of its active joints has a motor: {}", draft.actuators.len());
        reading.log.taken(At::Hand, "robot", text);
    }
    draft.exclusions.extend(model.adjacent);
}

/// The joint to each body but the first, outwards from it. A joint between bodies that are both reached closes a chain.
fn leads<'a>(model: &'a Model, reading: &mut Reading<'_>) -> BTreeMap<usize, Lead<'a>> {
    let mut leads: BTreeMap<usize, Lead<'a>> = BTreeMap::new();
    let mut used = vec![false; model.joints.len()];
    let mut open = Vec::from_iter((!model.bodies.is_empty()).then_some(0));
    let mut reached = vec![false; model.bodies.len()];
    while let Some(parent) = open.pop() {
        reached[parent] = true;
        for (j, hinge) in model.joints.iter().enumerate() {
            let (child, sign) = match hinge.bodies {
                [a, b] if a == parent => (b, 1.0),
                [a, b] if b == parent => (a, -1.0),
                _ => continue,
            };
            if used[j] {
                continue;
            }
            used[j] = true;
            if reached[child] || leads.contains_key(&child) {
                let text =
                    "closes a chain of bodies; it is left out: state its pin as [linkages] in hand.toml";
                reading.log.problem(At::Hand, format!("joint '{}'", hinge.name), text);
                continue;
            }
            leads.insert(child, Lead { hinge, parent, sign });
            open.push(child);
        }
    }
    for (k, body) in model.bodies.iter().enumerate().filter(|(k, _)| !reached[*k]) {
        let text = "no joint leads to it: it is left out".to_owned();
        reading.log.problem(At::Hand, format!("body '{}' ({k})", body.name), text);
    }
    leads
}
