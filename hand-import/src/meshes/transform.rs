//! Triangles at their places in a scene.

use nalgebra::{Matrix4, Point3};
use palmares_models::Vec3;

use super::text::Corners;
use crate::source::limits;

/// Nodes of a scene inside each other.
pub(super) const MAX_DEPTH: usize = 64;
/// Nodes that are placed: a scene can name a node many times.
pub(super) const MAX_NODES: usize = 100_000;

/// Adds triangles at a place. A scene can name a mesh many times: their number is bounded.
pub(super) fn place(triangles: &Corners, to: &Matrix4<f64>, corners: &mut Corners) -> Result<(), String> {
    let most = limits().mesh_vertices;
    // An empty mesh counts as a triangle, so that a small file cannot name it without end.
    if 3 * (corners.len() + triangles.len().max(1)) > most {
        return Err(format!("has more than {most} vertices"));
    }
    let mirrored = to.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|p| {
            let p = to.transform_point(&Point3::new(p.x, p.y, p.z));
            Vec3::new(p.x, p.y, p.z)
        });
        corners.push(if mirrored { [a, c, b] } else { [a, b, c] });
    }
    Ok(())
}
