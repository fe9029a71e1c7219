//! The points of a triangle mesh become a rounded hull of few points.
//!
//! Colliding a mesh's full hull takes too long: a fingertip has hundreds of vertices. So each face of the hull is
//! moved inward by the rounding, of the result the support points along evenly spread directions are kept, and the
//! hull of these is grown by the rounding again. Faces stay where they were; edges and corners become round.

use parry3d_f64::transformation::try_convex_hull;

use super::Shape;
use super::inertia::volume;
use super::support::{fibonacci_direction, support};
use crate::Vec3;

/// The rounded hull of points: see the module. Falls back to a hull without rounding, and says so by the flag,
/// when the body is too thin to be moved inward. `None` when the points span no volume.
pub fn rounded_hull(points: &[Vec3], directions: usize, rounding: f64) -> Option<(Shape, bool)> {
    let thinned = (points.len() > THINNED_DIRECTIONS).then(|| thinned(points));
    let points = thinned.as_deref().unwrap_or(points);
    let inset = (rounding > 0.0).then(|| inset_vertices(points, rounding)).flatten();
    let rounded = inset.is_some();
    let source = inset.as_deref().unwrap_or(points);
    let mut kept: Vec<Vec3> = Vec::new();
    for i in 0..directions {
        let p = support(source, fibonacci_direction(i, directions))?;
        // Faces that met in one corner meet in several after the offset, a few nanometres apart.
        if kept.iter().all(|k| (*k - p).length() > 1e-5) {
            kept.push(p);
        }
    }
    let points = kept.iter().map(|p| p.to_array()).collect();
    let shape = Shape::Hull { points, rounding: if rounded { rounding } else { 0.0 } };
    (volume(&shape) > 0.0).then_some((shape, rounded))
}

/// Directions whose support points stand for a mesh of more points: a ball of 5 cm loses 0.03 mm. Comparing faces with
/// each other takes time by the square of their number.
const THINNED_DIRECTIONS: usize = 1024;

/// The support points along many directions.
fn thinned(points: &[Vec3]) -> Vec<Vec3> {
    let along = |i| support(points, fibonacci_direction(i, THINNED_DIRECTIONS));
    let mut kept: Vec<Vec3> = (0..THINNED_DIRECTIONS).filter_map(along).collect();
    kept.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    kept.dedup();
    kept
}

/// Vertices of the hull after moving each face plane inward by `distance`.
///
/// Planes n·x = d around an inner point are the points n/d of the polar body; the faces of that body's hull are
/// the vertices looked for.
fn inset_vertices(points: &[Vec3], distance: f64) -> Option<Vec<Vec3>> {
    let (vertices, faces) = try_convex_hull(points).ok()?;
    let centre = vertices.iter().copied().sum::<Vec3>() / vertices.len() as f64;
    let mut planes: Vec<(Vec3, f64)> = Vec::new();
    for face in faces {
        let [a, b, c] = face.map(|i| vertices[i as usize] - centre);
        let normal = (b - a).cross(c - a);
        // Slivers have no direction of their own; their neighbours bound the body.
        if normal.length() < 1e-12 {
            continue;
        }
        let n = normal.normalize();
        let d = n.dot(a) - distance;
        if d <= 0.05 * distance {
            return None;
        }
        if planes.iter().all(|(m, e)| m.dot(n) < 0.999_999 || (e - d).abs() > 1e-6) {
            planes.push((n, d));
        }
    }
    let polar: Vec<Vec3> = planes.iter().map(|(n, d)| *n / *d).collect();
    let (polar_vertices, polar_faces) = try_convex_hull(&polar).ok()?;
    let mut out = Vec::new();
    for face in polar_faces {
        let [a, b, c] = face.map(|i| polar_vertices[i as usize]);
        let normal = (b - a).cross(c - a);
        let d = normal.dot(a);
        if d > 0.0 {
            let p = normal / d;
            // A sliver of the polar body would place its vertex outside; keep what every plane admits.
            if planes.iter().all(|(n, e)| n.dot(p) <= e + 1e-6) {
                out.push(p + centre);
            }
        }
    }
    (out.len() >= 4).then_some(out)
}
