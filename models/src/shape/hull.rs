//! Turns the points of a triangle mesh into a rounded hull of few points.
//!
//! Colliding a mesh's full hull takes too long: a fingertip has hundreds of vertices. So each face of the
//! hull is moved inward by the rounding, the support points of the result along evenly spread directions are
//! kept, and their hull is grown by the rounding again. Faces stay in place; edges and corners become round.

use std::borrow::Cow;

use parry3d_f64::transformation::try_convex_hull;

use super::Shape;
use super::inertia::volume;
use super::support::{fibonacci_direction, support};
use crate::Vec3;

/// The rounded hull of points: see the module. For a body too thin to be moved inward it is a hull without
/// rounding, and the flag is false. `None` if the points span no volume.
pub fn rounded_hull(points: &[Vec3], directions: usize, rounding: f64) -> Option<(Shape, bool)> {
    let points = &*outermost(points);
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

/// Number of directions whose support points represent a mesh of more points: a ball of 5 cm loses 0.03 mm.
/// The time to compare faces with each other grows with the square of their number.
pub const THINNED_DIRECTIONS: usize = 1024;

/// The points from which a hull is made: all of few, of many the support points along [`THINNED_DIRECTIONS`].
pub(crate) fn outermost(points: &[Vec3]) -> Cow<'_, [Vec3]> {
    match points.len() > THINNED_DIRECTIONS {
        true => Cow::Owned(thinned(points, THINNED_DIRECTIONS)),
        false => Cow::Borrowed(points),
    }
}

/// The points that are farthest along this number of directions.
pub fn thinned(points: &[Vec3], directions: usize) -> Vec<Vec3> {
    let along = |i| support(points, fibonacci_direction(i, directions));
    let mut kept: Vec<Vec3> = (0..directions).filter_map(along).collect();
    kept.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    kept.dedup();
    kept
}

/// The hull of points without rounding, if it has at most `most` points; else the hull of `most` of them,
/// each chosen where the hull of the earlier ones is farthest off. `None` if the points span no volume.
pub fn sharp_hull(points: &[Vec3], most: usize) -> Option<Shape> {
    let thinned = (points.len() > UNTHINNED).then(|| thinned(points, THINNED_DIRECTIONS));
    let kept = few_points(thinned.as_deref().unwrap_or(points), most, 0.0)?;
    let shape = Shape::Hull { points: kept.iter().map(|p| p.to_array()).collect(), rounding: 0.0 };
    (volume(&shape) > 0.0).then_some(shape)
}

/// Number of points from which a sharp hull chooses; of more, only the support points along many directions.
const UNTHINNED: usize = 4096;

/// Vertices of the hull of points: all of them, or enough that no point is farther than `tolerance` outside
/// of their hull, and never more than `most`.
pub(crate) fn few_points(points: &[Vec3], most: usize, tolerance: f64) -> Option<Vec<Vec3>> {
    let (vertices, _) = try_convex_hull(points).ok()?;
    if vertices.len() <= most && tolerance <= 0.0 {
        return Some(vertices);
    }
    let mut kept: Vec<Vec3> = Vec::new();
    for i in 0..FIRST_DIRECTIONS.min(most) {
        let p = support(&vertices, fibonacci_direction(i, FIRST_DIRECTIONS))?;
        if !kept.contains(&p) {
            kept.push(p);
        }
    }
    while kept.len() < most {
        let Ok((corners, faces)) = try_convex_hull(&kept) else { break };
        let planes = planes(&corners, &faces);
        let (mut farthest, mut lacking) = (None, tolerance.max(1e-9));
        for v in &vertices {
            let outside = outside(&planes, *v);
            if outside > lacking {
                (farthest, lacking) = (Some(*v), outside);
            }
        }
        let Some(farthest) = farthest.filter(|v| !kept.contains(v)) else { break };
        kept.push(farthest);
    }
    Some(kept)
}

/// Directions along which the first points of a hull are chosen: they span a volume.
const FIRST_DIRECTIONS: usize = 14;

/// Planes n·x = d of a hull's faces, n outward. Slivers have no reliable normal and are skipped.
pub(crate) fn planes(vertices: &[Vec3], faces: &[[u32; 3]]) -> Vec<(Vec3, f64)> {
    let plane = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|i| vertices[i as usize]);
        let normal = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        (normal.length() > 1e-9 * longest).then(|| {
            let n = normal.normalize();
            (n, n.dot(a))
        })
    };
    faces.iter().filter_map(plane).collect()
}

/// Distance of a point outside of the planes of a hull, m: at most its distance from the hull; negative
/// inside.
pub(crate) fn outside(planes: &[(Vec3, f64)], p: Vec3) -> f64 {
    planes.iter().map(|(n, d)| n.dot(p) - d).fold(f64::NEG_INFINITY, f64::max)
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
        // Slivers have no reliable normal; their neighbours bound the body.
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
            // A sliver of the polar body would put its vertex outside; only points within every plane are
            // kept.
            if planes.iter().all(|(n, e)| n.dot(p) <= e + 1e-6) {
                out.push(p + centre);
            }
        }
    }
    (out.len() >= 4).then_some(out)
}
