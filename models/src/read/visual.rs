//! Appearance of links in a URDF. The physics does not use it, so unreadable parts are skipped.

use std::path::Path;

use urdf_rs::Geometry;

use super::files::Files;
use super::limits::Limits;
use super::mesh::mesh_path;
use super::report::Report;
use super::stl;
use super::urdf::tree::{Urdf, pose};
use crate::shape::Shape;
use crate::{Pose, Vec3};

/// Largest number of triangles of all meshes together; the rest is skipped.
const MAX_TRIANGLES: usize = 200_000;

/// Appearance of a part of a link.
#[derive(Clone, Debug, PartialEq)]
pub enum Look {
    /// A shape that the physics also has.
    Shape(Shape),
    /// Triangles: three corners each, m.
    Mesh(Vec<[[f32; 3]; 3]>),
}

/// A visible part of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Visual {
    /// Index of its link in the hand.
    pub link: usize,
    /// Pose in the link's frame.
    pub link_from_visual: Pose,
    /// Its appearance.
    pub look: Look,
}

/// Every readable `<visual>` of a tree, on the links of the hand; `merged_into` maps to these.
pub(super) fn visuals(
    urdf: &Urdf,
    merged_into: &[Option<(usize, Pose)>],
    files: &Files,
    limits: &Limits,
) -> Vec<Visual> {
    let mut left = MAX_TRIANGLES;
    let mut visuals = Vec::new();
    for (link, into) in urdf.robot.links.iter().zip(merged_into) {
        let Some((index, link_from_urdf)) = *into else { continue };
        for visual in link.visual.iter().take(limits.link_shapes) {
            let Some(look) = look(&visual.geometry, files, limits, &mut left) else { continue };
            let link_from_visual = link_from_urdf * pose(&visual.origin);
            visuals.push(Visual { link: index, link_from_visual, look });
        }
    }
    visuals
}

fn look(geometry: &Geometry, files: &Files, limits: &Limits, left: &mut usize) -> Option<Look> {
    let shape = match geometry {
        Geometry::Sphere { radius } => Shape::Sphere { radius: *radius },
        Geometry::Capsule { radius, length } => Shape::Capsule { radius: *radius, half_length: 0.5 * length },
        Geometry::Cylinder { radius, length } => {
            Shape::Cylinder { radius: *radius, half_length: 0.5 * length }
        }
        Geometry::Box { size } => Shape::Box { half_extents: size.map(|x| 0.5 * x), rounding: 0.0 },
        Geometry::Mesh { filename, scale } => {
            let scale = scale.map_or(Vec3::ONE, |s| Vec3::from_array(*s));
            return mesh(filename, scale, files, limits, left).map(Look::Mesh);
        }
    };
    shape.validate().is_ok().then_some(Look::Shape(shape))
}

fn mesh(
    name: &str,
    scale: Vec3,
    files: &Files,
    limits: &Limits,
    left: &mut usize,
) -> Option<Vec<[[f32; 3]; 3]>> {
    let path = mesh_path(name, "visual", &Report::new(Path::new(""))).ok()?;
    let bytes = files.read(&path, "visual", limits.mesh_bytes).ok()?;
    let triangles = stl::triangles(&bytes, scale, limits.length_m)?;
    *left = left.checked_sub(triangles.len())?;
    Some(triangles)
}
