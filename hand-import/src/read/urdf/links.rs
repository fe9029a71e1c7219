//! Links: mass, shapes, pictures.

use roxmltree::Node;

use super::super::reading::Reading;
use super::elements::{named, unread};
use crate::decision::At;
use crate::draft::{Geometry, Inertial, Link, LinkShape, Origin};
use crate::xml::{Element, child, children};

/// Elements of a link that are read.
const READ: [&str; 4] = ["inertial", "visual", "collision", "contact"];

/// Reads a `<link>`.
pub(super) fn link(node: Node<'_, '_>, reading: &mut Reading<'_>) -> Link {
    let name = named(node, reading);
    let shown = format!("link '{name}'");
    let at = At::Link(name.clone());
    let mut e = Element { name: &shown, at: at.clone(), log: &mut reading.log };
    let inertial = child(node, "inertial").map(|node| inertial(node, &mut e));
    // An extension of Bullet.
    let contact = child(node, "contact").and_then(|contact| child(contact, "lateral_friction"));
    let friction = contact.and_then(|friction| e.attribute(friction, "value"));
    if let Some(mu) = friction {
        e.log.taken(at, &shown, format!("lateral_friction {mu} is the link's friction"));
    }
    let collisions = parts(node, "collision", &shown, &name, false, reading);
    let visuals = parts(node, "visual", &shown, &name, !collisions.is_empty(), reading);
    unread(node, &READ, "link", reading);
    Link { name, inertial, collisions, visuals, friction, ..Link::default() }
}

/// Reads an `<origin>`.
pub(super) fn origin(node: Node<'_, '_>, e: &mut Element<'_>) -> Origin {
    let xyz = e.numbers(node, "xyz").unwrap_or_default();
    Origin { xyz, rpy: e.numbers(node, "rpy").unwrap_or_default() }
}

fn inertial(node: Node<'_, '_>, e: &mut Element<'_>) -> Inertial {
    let mass = child(node, "mass").and_then(|mass| e.attribute(mass, "value"));
    let inertia = child(node, "inertia").map(|inertia| {
        ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(|name| e.attribute(inertia, name).unwrap_or_default())
    });
    Inertial {
        origin: child(node, "origin").map(|node| origin(node, e)).unwrap_or_default(),
        mass: mass.unwrap_or_default(),
        inertia: inertia.unwrap_or_default(),
    }
}

/// The shapes of a link; a `picture` of a link that has others can be left out without harm.
fn parts(
    node: Node<'_, '_>,
    tag: &str,
    shown: &str,
    link: &str,
    picture: bool,
    reading: &mut Reading<'_>,
) -> Vec<LinkShape> {
    let mut parts = Vec::new();
    for part in children(node, tag) {
        let mut e = Element { name: shown, at: At::Link(link.to_owned()), log: &mut reading.log };
        let origin = child(part, "origin").map(|node| origin(node, &mut e)).unwrap_or_default();
        let shape = child(part, "geometry").and_then(|node| node.children().find(Node::is_element));
        let Some(shape) = shape else {
            e.log.dropped(e.at.clone(), shown, format!("a <{tag}> has no geometry"));
            continue;
        };
        if let Some(geometry) = geometry(shape, shown, link, picture, reading) {
            parts.push(LinkShape { origin, geometry });
        }
    }
    parts
}

fn geometry(
    node: Node<'_, '_>,
    shown: &str,
    link: &str,
    picture: bool,
    reading: &mut Reading<'_>,
) -> Option<Geometry> {
    let at = At::Link(link.to_owned());
    let mut e = Element { name: shown, at: at.clone(), log: &mut reading.log };
    match node.tag_name().name() {
        "box" => Some(Geometry::Box(e.numbers(node, "size")?)),
        "sphere" => Some(Geometry::Sphere { radius: e.attribute(node, "radius")? }),
        "cylinder" => Some(Geometry::Cylinder {
            radius: e.attribute(node, "radius")?,
            length: e.attribute(node, "length")?,
        }),
        "capsule" => Some(Geometry::Capsule {
            radius: e.attribute(node, "radius")?,
            length: e.attribute(node, "length")?,
        }),
        "ellipsoid" => Some(Geometry::Ellipsoid(e.numbers(node, "radii")?)),
        "mesh" => {
            let scale = match node.attribute("scale") {
                // Some exporters write one number for all axes.
                Some(one) if one.split_whitespace().count() == 1 => [e.attribute(node, "scale")?; 3],
                Some(_) => e.numbers(node, "scale")?,
                None => [1.0; 3],
            };
            let file = node.attribute("filename").unwrap_or_default().to_owned();
            reading.mesh(&file, scale, at, shown, picture).map(Geometry::Mesh)
        }
        other => {
            let valid = "box, sphere, cylinder, capsule, ellipsoid, mesh";
            let text = format!("has a <{other}>, no shape of URDF; valid: {valid}; it is left out");
            reading.log.problem(at, shown, text);
            None
        }
    }
}
