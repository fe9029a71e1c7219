//! Bodies, divided into primitives that a ray meets in closed form.

use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use parry3d_f64::transformation::try_convex_hull;
use std::collections::BTreeMap;

/// The shapes of a body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Convex parts in the body's frame.
    pub parts: Vec<(Pose, Shape)>,
    /// It is a horizontal ground without end. Its one part is a box, whose top is the ground.
    pub endless: bool,
}

/// The shapes of all bodies, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Geometry {
    pub(super) bodies: Vec<BodyGeometry>,
}

/// A body's primitives in its own frame.
#[derive(Clone, Debug, Default)]
pub(super) struct BodyGeometry {
    /// Height of an endless ground above the origin of the body.
    pub(super) ground: Option<f64>,
    pub(super) solids: Vec<Solid>,
}

/// A convex part in the frame of its body.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    /// The sphere that encloses it: centre and radius.
    pub(super) center: Vec3,
    pub(super) radius: f64,
    pub(super) kind: SolidKind,
}

#[derive(Clone, Debug)]
pub(super) enum SolidKind {
    /// All points within the radius of a segment; a sphere when its ends are the same.
    Capsule { a: Vec3, b: Vec3, radius: f64 },
    /// A cylinder between the middles of its ends.
    Cylinder { a: Vec3, b: Vec3, radius: f64 },
    /// A convex polyhedron grown by the rounding.
    Rounded { faces: Vec<Face>, edges: Vec<Edge>, rounding: f64 },
}

/// A flat face, moved outwards by the rounding.
#[derive(Clone, Debug)]
pub(super) struct Face {
    /// Outwards.
    pub(super) normal: Vec3,
    /// Anticlockwise as seen from outside.
    pub(super) corners: Vec<Vec3>,
}

/// An edge where a rounded solid bends.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub(super) a: Vec3,
    pub(super) b: Vec3,
    /// The two faces of the edge.
    pub(super) faces: [usize; 2],
}

impl Geometry {
    /// The primitives of bodies. A hull without volume has none.
    pub fn new(bodies: &[Body]) -> Self {
        let primitives = bodies.iter().map(|body| match &body.parts[..] {
            [(pose, Shape::Box { half_extents, .. })] if body.endless => {
                BodyGeometry { ground: Some(pose.translation.z + half_extents[2]), solids: Vec::new() }
            }
            parts => BodyGeometry { ground: None, solids: parts.iter().filter_map(solid).collect() },
        });
        Geometry { bodies: primitives.collect() }
    }

    /// Distance from the origin of a body within which all of it is, m; of an endless ground 0.
    pub fn radius(&self, body: usize) -> f64 {
        let solids = self.bodies[body].solids.iter();
        solids.map(|solid| solid.center.length() + solid.radius).fold(0.0, f64::max)
    }
}

fn solid((pose, shape): &(Pose, Shape)) -> Option<Solid> {
    let along = pose.rotation * Vec3::Z;
    let segment = |half: f64| (pose.translation - along * half, pose.translation + along * half);
    let (kind, radius) = match shape {
        Shape::Sphere { radius } => {
            let (a, b) = (pose.translation, pose.translation);
            (SolidKind::Capsule { a, b, radius: *radius }, *radius)
        }
        Shape::Capsule { radius, half_length } => {
            let (a, b) = segment(*half_length);
            (SolidKind::Capsule { a, b, radius: *radius }, half_length + radius)
        }
        Shape::Cylinder { radius, half_length } => {
            let (a, b) = segment(*half_length);
            (
                SolidKind::Cylinder { a, b, radius: *radius },
                (half_length * half_length + radius * radius).sqrt(),
            )
        }
        Shape::Box { half_extents, rounding } => {
            return Some(polyhedron(pose, cuboid(half_extents.map(|x| x - rounding)), *rounding));
        }
        Shape::Hull { points, rounding } => {
            let points: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(*p)).collect();
            let (corners, triangles) = try_convex_hull(&points).ok()?;
            let faces = triangles.iter().map(|face| face.iter().map(|&k| k as usize).collect()).collect();
            return Some(polyhedron(pose, (corners, faces), *rounding));
        }
    };
    Some(Solid { center: pose.translation, radius, kind })
}

/// Corners and faces of a box.
fn cuboid(half: [f64; 3]) -> (Vec<Vec3>, Vec<Vec<usize>>) {
    let sign = |bit: usize, k: usize| if k >> bit & 1 == 1 { half[bit] } else { -half[bit] };
    let corners = (0..8).map(|k| Vec3::new(sign(0, k), sign(1, k), sign(2, k))).collect();
    let faces = [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]];
    (corners, faces.map(Vec::from).to_vec())
}

/// Two faces whose normals differ by less are one flat face.
const FLAT: f64 = 1.0 - 1e-10;

fn polyhedron(pose: &Pose, (corners, indices): (Vec<Vec3>, Vec<Vec<usize>>), rounding: f64) -> Solid {
    let corners: Vec<Vec3> = corners.iter().map(|p| pose.transform_point(*p)).collect();
    let mut faces: Vec<Face> = Vec::new();
    let mut sides: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for face in &indices {
        let [a, b, c] = [corners[face[0]], corners[face[1]], corners[face[2]]];
        let across = (b - a).cross(c - a);
        if across.length() < 1e-15 {
            continue;
        }
        let normal = across.normalize();
        for (k, &from) in face.iter().enumerate() {
            let to = face[(k + 1) % face.len()];
            sides.entry((from.min(to), from.max(to))).or_default().push(faces.len());
        }
        faces.push(Face { normal, corners: face.iter().map(|&k| corners[k] + normal * rounding).collect() });
    }
    let mut edges = Vec::new();
    for ((a, b), joined) in sides {
        // An edge next to a sliver that was dropped has one face.
        let faces_of = [joined[0], joined[joined.len() - 1]];
        let bends = faces[faces_of[0]].normal.dot(faces[faces_of[1]].normal) < FLAT || joined.len() == 1;
        if rounding > 0.0 && bends {
            edges.push(Edge { a: corners[a], b: corners[b], faces: faces_of });
        }
    }
    let center = corners.iter().copied().sum::<Vec3>() / corners.len().max(1) as f64;
    let radius = corners.iter().map(|p| (*p - center).length()).fold(0.0, f64::max) + rounding;
    Solid { center, radius, kind: SolidKind::Rounded { faces, edges, rounding } }
}
