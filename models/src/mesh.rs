//! Triangle meshes become rounded hulls of few points.
//!
//! A mesh's full hull is needlessly dear to collide (a fingertip has hundreds of vertices). What is kept: the hull
//! with every face moved inward by the rounding, of that the support points along evenly spread directions,
//! grown again by the rounding. Faces stay where they were; edges and corners become round.

use core::f64::consts::PI;
use std::path::Path;

use parry3d_f64::transformation::try_convex_hull;

use crate::error::ModelError;
use crate::shape::Shape;
use crate::{Vec3, inertia};

/// Point `i` of `n` spread evenly over the unit sphere along a Fibonacci spiral.
pub fn fibonacci_direction(i: usize, n: usize) -> Vec3 {
    let z = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let golden_angle = PI * (3.0 - 5.0_f64.sqrt());
    let (sin, cos) = libm::sincos(golden_angle * i as f64);
    Vec3::new(r * cos, r * sin, z)
}

/// The point farthest along `direction`; the first of several.
pub fn support(points: &[Vec3], direction: Vec3) -> Option<Vec3> {
    let mut best: Option<(f64, Vec3)> = None;
    for &p in points {
        let height = p.dot(direction);
        if best.is_none_or(|(h, _)| height > h) {
            best = Some((height, p));
        }
    }
    best.map(|(_, p)| p)
}

/// What a mesh may have.
#[derive(Clone, Copy, Debug)]
pub struct MeshLimits {
    /// Corners, three per triangle.
    pub vertices: usize,
    /// Distance of a corner from the origin along each axis after scaling, m.
    pub length_m: f64,
}

/// Vertices of an STL file's bytes, scaled to metres, sorted and each once. `file` and `element` are for messages.
///
/// # Errors
/// It is not STL, is cut short, has too many corners, or one that is not finite or too far away.
pub fn read_stl(
    file: &Path,
    element: &str,
    bytes: &[u8],
    scale: Vec3,
    limits: MeshLimits,
) -> Result<Vec<Vec3>, ModelError> {
    let syntax = |message: String| ModelError::Syntax { file: file.to_owned(), format: "STL", message };
    check_count(bytes).map_err(syntax)?;
    let scene = mesh_loader::stl::from_slice(bytes).map_err(|e| syntax(e.to_string()))?;
    let mut points = Vec::new();
    for mesh in &scene.meshes {
        for v in &mesh.vertices {
            points.push(Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])) * scale);
        }
    }
    if points.len() > limits.vertices {
        return Err(ModelError::TooLarge {
            file: file.to_owned(),
            element: element.to_owned(),
            what: "vertices",
            found: points.len() as u64,
            limit: limits.vertices as u64,
        });
    }
    let near = |p: &Vec3| p.to_array().iter().all(|x| x.abs() <= limits.length_m);
    if let Some(far) = points.iter().find(|p| !near(p)) {
        return Err(ModelError::Element {
            file: file.to_owned(),
            element: element.to_owned(),
            problem: format!("its mesh has a corner at {:.4} {:.4} {:.4} m", far.x, far.y, far.z),
            valid: format!(
                "corners within {} m of the origin; a mesh in millimetres needs scale=\"0.001 0.001 0.001\"",
                limits.length_m
            ),
        });
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    points.dedup();
    Ok(points)
}

/// A binary STL states how many triangles follow; what it states must be there. Parsers trust one or the other.
fn check_count(bytes: &[u8]) -> Result<(), String> {
    const HEADER: usize = 80;
    const TRIANGLE: u64 = 50;
    // `solid` begins an ASCII file, or a binary one by careless authors: then the size decides.
    let text = bytes.trim_ascii_start().starts_with(b"solid");
    let Some(count) = bytes.get(HEADER..HEADER + 4).and_then(|b| <[u8; 4]>::try_from(b).ok()) else {
        return if text { Ok(()) } else { Err(format!("{} bytes are no STL file", bytes.len())) };
    };
    let (stated, body) = (u64::from(u32::from_le_bytes(count)), (bytes.len() - HEADER - 4) as u64);
    let fits = stated * TRIANGLE <= body && body - stated * TRIANGLE <= 2;
    if fits || text {
        return Ok(());
    }
    Err(format!("its header promises {stated} triangles, {} bytes each, but {body} bytes follow", TRIANGLE))
}

/// The rounded hull of points: see the module. Falls back to a hull without rounding, and says so by the flag,
/// when the body is too thin to be moved inward. `None` when the points span no volume.
pub fn rounded_hull(points: &[Vec3], directions: usize, rounding: f64) -> Option<(Shape, bool)> {
    let thinned = (points.len() > THINNED_FROM).then(|| thinned(points));
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
    (inertia::volume(&shape) > 0.0).then_some((shape, rounded))
}

/// More points than this are thinned before faces are compared with each other, which takes time by their square.
const THINNED_FROM: usize = THINNED_DIRECTIONS;
/// Directions whose support points stand for a finer mesh: a ball of 5 cm loses 0.03 mm.
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
