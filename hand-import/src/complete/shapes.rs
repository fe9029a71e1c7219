//! Shapes that touch: those of the source, or its pictures if the caller wants them.

use crate::decision::{At, Log};
use crate::draft::{Draft, Geometry};
use crate::options::ImportOptions;

/// Replaces missing collision shapes, and removes shapes without a size.
pub(crate) fn complete(draft: &mut Draft, options: &ImportOptions, log: &mut Log) {
    let mut bare = Vec::new();
    for link in &mut draft.links {
        let (at, element) = (At::Link(link.name.clone()), format!("link '{}'", link.name));
        let mut sized = |part: &crate::draft::LinkShape| {
            let right = match &part.geometry {
                Geometry::Box(size) => size.iter().all(|x| *x > 0.0),
                Geometry::Sphere { radius } => *radius > 0.0,
                Geometry::Cylinder { radius, length } => *radius > 0.0 && *length > 0.0,
                Geometry::Capsule { radius, length } => *radius > 0.0 && *length >= 0.0,
                Geometry::Ellipsoid(radii) => radii.iter().all(|x| *x > 0.0),
                Geometry::Mesh(mesh) => mesh.scale.iter().all(|x| *x != 0.0),
            };
            if !right {
                let sizes = sizes(&part.geometry);
                let text = format!("has a shape with the sizes {sizes}; valid: more than 0; it is left out");
                log.problem(at.clone(), &element, text);
            }
            right
        };
        link.collisions.retain(&mut sized);
        link.visuals.retain(&mut sized);
        if !link.collisions.is_empty() || link.visuals.is_empty() {
            continue;
        }
        if options.visual_as_collision {
            link.collisions.clone_from(&link.visuals);
            let text = "has no <collision>; its <visual> is what touches (--visual-as-collision)";
            log.guessed(at, element, text);
        } else {
            bare.push(link.name.clone());
        }
    }
    if draft.links.iter().all(|link| link.collisions.is_empty()) && !bare.is_empty() {
        let text =
            "no link has a <collision>, so that nothing touches; --visual-as-collision uses the pictures";
        log.problem(At::Hand, "robot", text);
        return;
    }
    for link in bare {
        let text = "has a <visual> but no <collision>, so that it touches nothing; --visual-as-collision uses the picture";
        log.taken(At::Link(link.clone()), format!("link '{link}'"), text);
    }
}

/// The sizes of a shape, as its source lists them.
fn sizes(geometry: &Geometry) -> String {
    let list = match geometry {
        Geometry::Box(sizes) | Geometry::Ellipsoid(sizes) => sizes.to_vec(),
        Geometry::Sphere { radius } => vec![*radius],
        Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => {
            vec![*radius, *length]
        }
        Geometry::Mesh(mesh) => mesh.scale.to_vec(),
    };
    list.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}
