//! From the URDF's joints to few coordinates: mimics folded, couplers of rolling joints removed, fixed joints merged.
//!
//! A rolling (Hillberry) joint comes as two hinges with a coupler between them that touches nothing. Both turn by
//! the same coordinate, so the pair is one [`Joint`] and the coupler, whose mass is fictitious, vanishes.

use urdf_rs::JointType;

use crate::error::ModelError;
use crate::geometry::{Body, Builder};
use crate::hand::{Geom, Hinge, HingeKind, Inertia, Joint, Link};
use crate::load::Report;
use crate::urdf::{self, Urdf};
use crate::{Pose, Vec3};

/// How a joint follows an independent one: x = ratio · q + offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// Index of the URDF joint that carries q.
    pub(crate) leader: usize,
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
}

/// The tree of a hand and which URDF joints carry its coordinates.
pub(crate) struct Reduced {
    pub(crate) links: Vec<Link>,
    /// URDF joint index of each coordinate, in file order.
    pub(crate) coordinates: Vec<usize>,
    /// Per URDF joint; `None` when it is fixed or dropped.
    pub(crate) motions: Vec<Option<Motion>>,
    /// Per URDF link: the link it became part of and where in it it sits; `None` when it vanished.
    pub(crate) places: Vec<Option<(usize, Pose)>>,
}

/// Reduces a URDF's tree.
pub(crate) fn reduce(urdf: &Urdf, builder: &Builder<'_>, report: &mut Report) -> Result<Reduced, ModelError> {
    let motions = motions(urdf, report)?;
    let coordinates: Vec<usize> =
        (0..motions.len()).filter(|&j| motions[j].is_some_and(|m| m.leader == j)).collect();
    let bodies = urdf
        .robot
        .links
        .iter()
        .map(|link| builder.body(link, report))
        .collect::<Result<Vec<Body>, ModelError>>()?;

    let base = Link {
        name: urdf.robot.links[urdf.root].name.clone(),
        parent: None,
        joint: None,
        inertia: Inertia::ZERO,
        geoms: Vec::new(),
    };
    let mut links = vec![base];
    // URDF links still to place: which link they belong to and where in it they sit.
    let mut open = vec![(urdf.root, 0, Pose::IDENTITY)];
    let mut places = vec![None; bodies.len()];
    while let Some((urdf_link, link, link_from_urdf)) = open.pop() {
        let body = &bodies[urdf_link];
        places[urdf_link] = Some((link, link_from_urdf));
        links[link].inertia = links[link].inertia.plus(&body.inertia.moved(&link_from_urdf));
        links[link].geoms.extend(body.geoms.iter().map(|g| Geom {
            link_from_geom: link_from_urdf * g.link_from_geom,
            shape: g.shape.clone(),
            friction: g.friction,
        }));
        let mut below = Vec::new();
        for &j in &urdf.children[urdf_link] {
            let joint = &urdf.robot.joints[j];
            let child_from_origin = link_from_urdf * urdf::pose(&joint.origin);
            if joint.joint_type == JointType::Fixed {
                below.push((urdf.child_link[j], link, child_from_origin));
                continue;
            }
            let Some(motion) = motions[j] else { continue };
            let coordinate = coordinates.iter().position(|&c| c == motion.leader).unwrap_or_default();
            let mut hinges = vec![hinge(urdf, j, motion, child_from_origin, report)?];
            let mut child = urdf.child_link[j];
            if let Some(second) = outer_hinge(urdf, &motions, &bodies, j) {
                let coupler = &urdf.robot.links[child];
                if bodies[child].inertia.mass > 0.0 {
                    report.warn(
                        format!("link '{}'", coupler.name),
                        format!(
                            "couples a rolling joint; its mass of {} kg is dropped",
                            bodies[child].inertia.mass
                        ),
                    );
                }
                let joint = &urdf.robot.joints[second];
                if let Some(motion) = motions[second] {
                    hinges.push(hinge(urdf, second, motion, urdf::pose(&joint.origin), report)?);
                }
                child = urdf.child_link[second];
            }
            links.push(Link {
                name: urdf.robot.links[child].name.clone(),
                parent: Some(link),
                joint: Some(Joint { name: joint.name.clone(), coordinate, hinges }),
                inertia: Inertia::ZERO,
                geoms: Vec::new(),
            });
            below.push((child, links.len() - 1, Pose::IDENTITY));
        }
        // Depth first in file order: a finger's links stand together.
        open.extend(below.into_iter().rev());
    }
    let links = depth_first(links, &mut places);
    Ok(Reduced { links, coordinates, motions, places })
}

/// Reorders so that each chain is contiguous; links were numbered when their parent was visited.
fn depth_first(links: Vec<Link>, places: &mut [Option<(usize, Pose)>]) -> Vec<Link> {
    let mut order = Vec::with_capacity(links.len());
    let mut open = vec![0];
    while let Some(i) = open.pop() {
        order.push(i);
        open.extend((0..links.len()).rev().filter(|&c| links[c].parent == Some(i)));
    }
    let mut new_index = vec![0; links.len()];
    for (new, &old) in order.iter().enumerate() {
        new_index[old] = new;
    }
    for (link, _) in places.iter_mut().flatten() {
        *link = new_index[*link];
    }
    order
        .iter()
        .map(|&old| Link { parent: links[old].parent.map(|p| new_index[p]), ..links[old].clone() })
        .collect()
}

fn hinge(
    urdf: &Urdf,
    j: usize,
    motion: Motion,
    parent_from_hinge: Pose,
    report: &Report,
) -> Result<Hinge, ModelError> {
    let joint = &urdf.robot.joints[j];
    let axis = Vec3::from_array(*joint.axis.xyz);
    if axis.length() < 1e-9 {
        return Err(report.bad(
            format!("joint '{}'", joint.name),
            "has the axis 0 0 0",
            "an axis with a direction",
        ));
    }
    let kind =
        if joint.joint_type == JointType::Prismatic { HingeKind::Prismatic } else { HingeKind::Revolute };
    Ok(Hinge { parent_from_hinge, axis: axis.normalize(), kind, ratio: motion.ratio, offset: motion.offset })
}

/// The second hinge of a rolling joint that begins with joint `j`: its coupler touches nothing, carries one joint
/// and that joint moves by the same coordinate.
fn outer_hinge(urdf: &Urdf, motions: &[Option<Motion>], bodies: &[Body], j: usize) -> Option<usize> {
    let coupler = urdf.child_link[j];
    let &[second] = urdf.children[coupler].as_slice() else { return None };
    let same = motions[second]?.leader == motions[j]?.leader;
    (same && bodies[coupler].geoms.is_empty()).then_some(second)
}

/// What each joint follows. Joints that move nothing are dropped and reported.
fn motions(urdf: &Urdf, report: &mut Report) -> Result<Vec<Option<Motion>>, ModelError> {
    let joints = &urdf.robot.joints;
    let index = |name: &str| joints.iter().position(|j| j.name == name);
    let in_transmission =
        |name: &str| urdf.transmissions.iter().any(|t| t.joints.iter().any(|j| j.joint == name));
    // Files of the 2016 challenge carry no <mimic>: their couplings are in the names alone.
    let names_only = joints.iter().all(|j| j.mimic.is_none());

    let mut step: Vec<Option<Motion>> = Vec::new();
    for (j, joint) in joints.iter().enumerate() {
        let element = format!("joint '{}'", joint.name);
        if !urdf::moves(joint, report)? {
            step.push(None);
            continue;
        }
        if let Some(mimic) = &joint.mimic {
            let leader = index(&mimic.joint)
                .filter(|&l| l != j && joints[l].joint_type != JointType::Fixed)
                .ok_or_else(|| {
                    let problem = format!("mimics '{}'", mimic.joint);
                    report.bad(element, problem, "the name of another, moving joint of this file")
                })?;
            let (ratio, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
            step.push(Some(Motion { leader, ratio, offset }));
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
        if carries_nothing && !in_transmission(&joint.name) {
            report.warn(
                element,
                format!(
                    "moves only link '{}', which touches nothing; both are dropped",
                    urdf.robot.links[child].name
                ),
            );
            step.push(None);
        } else {
            step.push(Some(Motion { leader: j, ratio: 1.0, offset: 0.0 }));
        }
    }

    // Follow mimics of mimics to the independent joint, which leads itself.
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
    Ok(resolved)
}
