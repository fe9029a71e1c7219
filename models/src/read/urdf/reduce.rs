//! From the URDF's tree to the hand's smaller one: links behind fixed joints are merged with their parents,
//! and the couplers of rolling joints are removed. Mimics are folded before, in `mimic.rs`.
//!
//! A rolling (Hillberry) joint comes as two hinges with a coupler between them that touches nothing. Both
//! turn by the same coordinate, so the pair is one [`Joint`]; the coupler, whose mass is fictitious, is
//! removed.

use urdf_rs::JointType;

use super::link::{LinkBody, LinkReader};
use super::massless::share_mass;
use super::mimic::{Motion, motions};
use super::tree::{Urdf, pose};
use crate::error::ModelError;
use crate::hand::{Geom, Hinge, HingeKind, Inertia, Joint, Link, PadOn};
use crate::read::report::Report;
use crate::{Pose, Vec3};

/// The tree of a hand and the URDF joints that carry its coordinates.
pub(crate) struct Reduced {
    pub(crate) links: Vec<Link>,
    /// URDF joint index of each coordinate, in file order.
    pub(crate) coordinates: Vec<usize>,
    /// Per URDF joint; `None` if it is fixed or dropped.
    pub(crate) motions: Vec<Option<Motion>>,
    /// Per URDF link: the link into which it was merged, and its pose in that link's frame; `None` if it was
    /// removed.
    pub(crate) merged_into: Vec<Option<(usize, Pose)>>,
    /// Soft shapes.
    pub(crate) pads: Vec<PadOn>,
}

/// Reduces a URDF's tree to the moving links and their coordinates; `None` if the joints' motions are in error. Errors of links are
/// kept. `base_from_root` is the pose of the root in the frame of the base.
pub(crate) fn reduce(
    urdf: &Urdf,
    base_from_root: Pose,
    reader: &mut LinkReader<'_>,
    report: &mut Report,
) -> Result<Option<Reduced>, ModelError> {
    let motions = motions(urdf, reader.settings(), report)?;
    let bodies = urdf
        .robot
        .links
        .iter()
        .map(|link| reader.read(link, report))
        .collect::<Result<Vec<LinkBody>, ModelError>>()?;
    let Some(motions) = motions else { return Ok(None) };
    let coordinates: Vec<usize> =
        (0..motions.len()).filter(|&j| motions[j].is_some_and(|m| m.leader == j)).collect();
    let base = Link {
        name: urdf.robot.links[urdf.root].name.clone(),
        parent: None,
        joint: None,
        inertia: Inertia::ZERO,
        geoms: Vec::new(),
    };
    let (mut links, mut pads) = (vec![base], Vec::new());
    // URDF links still to merge: their target link, and their pose in its frame.
    let mut open = vec![(urdf.root, 0, base_from_root)];
    let mut merged_into = vec![None; bodies.len()];
    while let Some((urdf_link, link, link_from_urdf)) = open.pop() {
        let body = &bodies[urdf_link];
        merged_into[urdf_link] = Some((link, link_from_urdf));
        links[link].inertia = links[link].inertia.plus(&body.inertia.moved(&link_from_urdf));
        if let Some(pad) = body.pad {
            let first = links[link].geoms.len();
            pads.extend((first..first + body.geoms.len()).map(|geom| PadOn { link, geom, pad }));
        }
        links[link].geoms.extend(body.geoms.iter().map(|g| Geom {
            link_from_geom: link_from_urdf * g.link_from_geom,
            shape: g.shape.clone(),
            friction: g.friction,
        }));
        let mut below = Vec::new();
        for &j in &urdf.children[urdf_link] {
            let joint = &urdf.robot.joints[j];
            let child_from_origin = link_from_urdf * pose(&joint.origin);
            if joint.joint_type == JointType::Fixed {
                below.push((urdf.child_link[j], link, child_from_origin));
                continue;
            }
            let Some(motion) = motions[j] else { continue };
            let coordinate = coordinates.iter().position(|&c| c == motion.leader).unwrap_or_default();
            let mut hinges = vec![hinge(urdf, j, motion, child_from_origin, report)];
            let mut child = urdf.child_link[j];
            if let Some(second) = outer_hinge(urdf, &motions, &bodies, j) {
                let coupler = &urdf.robot.links[child];
                let mass = bodies[child].inertia.mass;
                if mass > 0.0 {
                    let message = format!("couples a rolling joint; its mass of {mass} kg is dropped");
                    report.warn(format!("link '{}'", coupler.name), message);
                }
                let joint = &urdf.robot.joints[second];
                if let Some(motion) = motions[second] {
                    hinges.push(hinge(urdf, second, motion, pose(&joint.origin), report));
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
        // Depth first in file order: a finger's links are contiguous.
        open.extend(below.into_iter().rev());
    }
    let mut links = depth_first(links, &mut merged_into, &mut pads);
    share_mass(&mut links, report);
    Ok(Some(Reduced { links, coordinates, motions, merged_into, pads }))
}

/// Reorders so that each chain is contiguous; links were numbered when their parent was visited.
fn depth_first(links: Vec<Link>, merged_into: &mut [Option<(usize, Pose)>], pads: &mut [PadOn]) -> Vec<Link> {
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
    for (link, _) in merged_into.iter_mut().flatten() {
        *link = new_index[*link];
    }
    for pad in pads {
        pad.link = new_index[pad.link];
    }
    order
        .iter()
        .map(|&old| Link { parent: links[old].parent.map(|p| new_index[p]), ..links[old].clone() })
        .collect()
}

fn hinge(urdf: &Urdf, j: usize, motion: Motion, parent_from_hinge: Pose, report: &Report) -> Hinge {
    let joint = &urdf.robot.joints[j];
    let axis = Vec3::from_array(*joint.axis.xyz);
    if axis.length() < 1e-9 {
        let element = format!("joint '{}'", joint.name);
        report.keep::<()>(Err(report.bad(element, "has the axis 0 0 0", "an axis with a direction")));
    }
    let kind =
        if joint.joint_type == JointType::Prismatic { HingeKind::Prismatic } else { HingeKind::Revolute };
    Hinge { parent_from_hinge, axis: axis.normalize(), kind, ratio: motion.ratio, offset: motion.offset }
}

/// The second hinge of a rolling joint that begins with joint `j`: its coupler touches nothing, carries one
/// joint and that joint moves by the same coordinate.
fn outer_hinge(urdf: &Urdf, motions: &[Option<Motion>], bodies: &[LinkBody], j: usize) -> Option<usize> {
    let coupler = urdf.child_link[j];
    let &[second] = urdf.children[coupler].as_slice() else { return None };
    let same = motions[second]?.leader == motions[j]?.leader;
    (same && bodies[coupler].geoms.is_empty()).then_some(second)
}
