//! A link's body file: geometry, mass, material.

use palmares_models::{Pose, Rotation, Vec3};

use super::transform::transform;
use super::units::{GRAM, MM};
use crate::decision::At;
use crate::draft::{Geometry, Inertial, Link, LinkShape, Origin};
use crate::read::reading::Reading;
use crate::xml::{Element, child, child_text};

/// The use of a body's modulus of elasticity.
const SOFT: &str = "is for GraspIt!'s soft contacts; `pad` in [links] makes a link soft";

/// A link by the file of its body, in `iv/` beside the robot. `shapes` is the file's frame in the link's.
pub(super) fn body(name: &str, file: &str, shapes: Origin, reading: &mut Reading<'_>) -> Link {
    let (at, element) = (At::Link(name.to_owned()), format!("link '{name}'"));
    let mut link = Link { name: name.to_owned(), ..Link::default() };
    if file.is_empty() {
        reading.log.problem(at, element, "names no body");
        return link;
    }
    let found = reading.source.resolve(&reading.path, &format!("iv/{file}"));
    let found = found.or_else(|_| reading.source.resolve(&reading.path, file));
    let inner = found.and_then(|found| reading.of(&found.path, &element).map_err(|error| error.to_string()));
    let mut inner = match inner {
        Ok(inner) => inner,
        Err(problem) => {
            reading.log.problem(at, element, format!("its body {problem}"));
            return link;
        }
    };
    let text = super::comments::without_comments(&inner.text);
    let document = match inner.xml(&text) {
        Ok(document) => document,
        Err(error) => {
            reading.log.problem(at, element, error.to_string());
            return link;
        }
    };
    let root = document.root_element();
    let mut e = Element { name: &element, at: at.clone(), log: &mut inner.log };
    let mut number = |tag: &str| child_text(root, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let mass = number("mass").map(|g| g * GRAM);
    let scale = match number("geometryScaling") {
        Some(scale) => [scale; 3],
        None => ["X", "Y", "Z"].map(|axis| number(&format!("geometryScaling{axis}")).unwrap_or(1.0)),
    };
    let cog = child_text(root, "cog").and_then(|text| e.list::<3>("<cog>", text));
    let matrix = child_text(root, "inertia_matrix").and_then(|text| e.list::<9>("<inertia_matrix>", text));
    if let Some(mass) = mass {
        // GraspIt! divides the matrix by the mass: mm².
        let i = matrix.map(|m| [m[0], m[1], m[2], m[4], m[5], m[8]].map(|x| x * MM * MM * mass));
        let com = Vec3::from_array(cog.unwrap_or_default()) * MM;
        let place = shapes.pose() * Pose::from_parts(com, Rotation::IDENTITY);
        link.inertial =
            Some(Inertial { origin: Origin::from_pose(&place), mass, inertia: i.unwrap_or_default() });
    }
    let offset = child(root, "geometryOffset").and_then(|node| child(node, "transform"));
    let offset = offset.map_or(Pose::IDENTITY, |node| transform(node, &element, &at, &mut inner.log));
    match child_text(root, "geometryFile") {
        Some(file) => {
            if let Some(mesh) = inner.mesh(file, scale.map(|s| s * MM), at.clone(), &element, false) {
                let origin = Origin::from_pose(&(shapes.pose() * offset));
                let part = LinkShape { origin, geometry: Geometry::Mesh(mesh) };
                link.visuals.push(part.clone());
                link.collisions.push(part);
            }
        }
        None => inner.log.taken(at.clone(), &element, "its body names no geometryFile"),
    }
    if child(root, "youngs").is_some() {
        inner.log.dropped(at.clone(), &element, format!("<youngs> {SOFT}"));
    }
    if let Some(material) = child_text(root, "material") {
        let friction = match material {
            "rubber" => Some(1.0),
            "wood" => Some(0.4),
            "plastic" => Some(0.3),
            "metal" => Some(0.2),
            _ => None,
        };
        if let Some(friction) = friction {
            link.friction = Some(friction);
            inner.log.guessed(at, &element, format!("its material '{material}' has the friction {friction}"));
        }
    }
    reading.log.decisions.append(&mut inner.log.decisions);
    link
}
