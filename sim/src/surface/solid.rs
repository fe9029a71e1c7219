//! Geometry that a manifold needs of a shape without its rounding: flat faces with all their corners, or the
//! line or rim of a curved side.

use palmares_models::Vec3;
use parry3d_f64::shape::SharedShape;
use parry3d_f64::transformation::try_convex_hull;

/// Triangles of a hull are one face if their corners are within this part of its size of one plane: triangles
/// of a mesh in single precision differ by rounding.
const COPLANAR: f64 = 1e-6;

/// Number of corners of the polygon that represents a cylinder's cap, fixed in the body: its area is that of
/// the disc within 3 %.
pub(crate) const CAP_CORNERS: usize = 16;

/// Towards directions with a larger cosine to the axis a cylinder shows its cap, otherwise a line of its
/// side.
const CAP_COSINE: f64 = 0.5;

/// Corners within this part of a hull's size of a plane are on it.
const ON_PLANE: f64 = 1e-7;

/// A shape without its rounding, in its own frame.
#[derive(Clone, Debug)]
pub enum Solid {
    /// A ball: its contacts are found in closed form.
    Ball,
    /// Everything below a plane through the origin.
    HalfSpace {
        /// Unit normal, outwards.
        normal: Vec3,
    },
    /// A box or a convex hull.
    Polytope(Polytope),
    /// A cylinder along y.
    Cylinder {
        /// m
        radius: f64,
        /// m
        half_length: f64,
    },
    /// The core of a capsule.
    Segment {
        /// Its ends, m.
        ends: [Vec3; 2],
    },
}

/// A convex body with flat faces.
#[derive(Clone, Debug)]
pub struct Polytope {
    /// Its corners, m.
    pub vertices: Vec<Vec3>,
    /// Its faces.
    pub faces: Vec<Face>,
    /// Corners of the faces, one face after the other.
    corners: Vec<u32>,
    /// Distances up to this are rounding, m.
    rounding_m: f64,
}

/// A flat face.
#[derive(Clone, Debug)]
pub struct Face {
    /// Unit normal, outwards.
    pub normal: Vec3,
    /// Distance of its plane from the origin along the normal, m.
    pub offset: f64,
    first: u32,
    count: u32,
}

/// A face, an edge or a line of a shape as a polygon, in the frame of shape A.
#[derive(Clone, Debug, Default)]
pub struct Feature {
    /// Its corners, in order. Two of them are a line, which has no plane.
    pub corners: Vec<Corner>,
    /// Unit normal of its plane, outwards.
    pub normal: Vec3,
    /// Id of the plane within the shape.
    pub face: u32,
    /// A line's radius of curvature across it, m; 0 for an edge.
    pub radius: f64,
}

/// A corner of a feature.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// m
    pub at: Vec3,
    /// Id of the corner within the shape.
    pub id: u32,
}

impl Solid {
    /// The core of a parry shape.
    pub fn of(core: &SharedShape) -> Solid {
        if let Some(half_space) = core.as_halfspace() {
            return Solid::HalfSpace { normal: half_space.normal };
        }
        if let Some(cuboid) = core.as_cuboid() {
            return Solid::Polytope(Polytope::cuboid(cuboid.half_extents));
        }
        if let Some(hull) = core.as_convex_polyhedron() {
            return Solid::Polytope(Polytope::hull(hull.points()));
        }
        if let Some(cylinder) = core.as_cylinder() {
            return Solid::Cylinder { radius: cylinder.radius, half_length: cylinder.half_height };
        }
        if let Some(segment) = core.as_segment() {
            return Solid::Segment { ends: [segment.a, segment.b] };
        }
        Solid::Ball
    }

    /// Whether it has caps, whose rims bear when they tilt.
    pub(crate) fn is_cylinder(&self) -> bool {
        matches!(self, Solid::Cylinder { .. })
    }

    /// Normals of its flat faces. A cylinder has two.
    pub fn normals(&self) -> impl Iterator<Item = Vec3> + '_ {
        let (faces, caps): (&[Face], &[Vec3]) = match self {
            Solid::Polytope(polytope) => (&polytope.faces, &[]),
            Solid::Cylinder { .. } => (&[], &[Vec3::Y, Vec3::NEG_Y]),
            Solid::Ball | Solid::HalfSpace { .. } | Solid::Segment { .. } => (&[], &[]),
        };
        faces.iter().map(|face| face.normal).chain(caps.iter().copied())
    }

    /// Distance of the closest two parallel planes, one of them along a face, that contain the solid between
    /// them, m. 0 for a ball, whose radius is not known here.
    pub fn width(&self) -> f64 {
        match self {
            Solid::Polytope(polytope) => {
                let across = |face: &Face| {
                    let farthest = polytope.vertices.iter().map(|vertex| vertex.dot(face.normal));
                    face.offset - farthest.fold(f64::INFINITY, f64::min)
                };
                polytope.faces.iter().map(across).fold(f64::INFINITY, f64::min)
            }
            Solid::Cylinder { radius, half_length } => 2.0 * radius.min(*half_length),
            Solid::Ball | Solid::Segment { .. } => 0.0,
            Solid::HalfSpace { .. } => f64::INFINITY,
        }
    }

    /// Its flat faces: id, unit normal and offset along it.
    pub(crate) fn planes(&self) -> impl Iterator<Item = (u32, Vec3, f64)> + '_ {
        let offset = move |k: usize| match self {
            Solid::Polytope(polytope) => polytope.faces[k].offset,
            Solid::Cylinder { half_length, .. } => *half_length,
            Solid::Ball | Solid::HalfSpace { .. } | Solid::Segment { .. } => 0.0,
        };
        self.normals().enumerate().map(move |(k, normal)| (k as u32, normal, offset(k)))
    }

    /// One of its flat faces.
    pub(crate) fn plane(&self, face: u32) -> (u32, Vec3, f64) {
        self.planes().nth(face as usize).unwrap_or((face, Vec3::Z, 0.0))
    }

    /// Whether a point in the plane of a face is on the face.
    pub(crate) fn is_over(&self, face: u32, at: Vec3) -> bool {
        let mut others = self.planes().filter(|(other, ..)| *other != face);
        let round = match self {
            Solid::Cylinder { radius, .. } => at.x * at.x + at.z * at.z <= radius * radius,
            _ => true,
        };
        round && others.all(|(_, n, offset)| n.dot(at) <= offset)
    }

    /// Its flat faces: id, unit normal and corners, counterclockwise as seen from outside.
    pub(crate) fn faces(&self) -> Vec<(u32, Vec3, Vec<Vec3>)> {
        let mut feature = Feature::default();
        let ring = |(face, normal, _): (u32, Vec3, f64)| {
            self.feature(normal, None, &mut feature);
            let mut corners: Vec<Vec3> = feature.corners.iter().map(|corner| corner.at).collect();
            let around = (0..corners.len()).fold(Vec3::ZERO, |sum, k| {
                sum + (corners[k] - corners[0]).cross(corners[(k + 1) % corners.len()] - corners[0])
            });
            if around.dot(normal) < 0.0 {
                corners.reverse();
            }
            (face, normal, corners)
        };
        self.planes().map(ring).collect()
    }

    /// The feature that faces `direction` at its support point `at`, if known.
    pub fn feature(&self, direction: Vec3, at: Option<Vec3>, to: &mut Feature) {
        to.corners.clear();
        to.radius = 0.0;
        match self {
            Solid::Ball | Solid::HalfSpace { .. } => {}
            Solid::Polytope(polytope) => {
                let k = polytope.facing(direction, at);
                let face = &polytope.faces[k];
                (to.normal, to.face) = (face.normal, k as u32);
                let corners = polytope.corners(face).iter();
                to.corners.extend(corners.map(|&id| Corner { at: polytope.vertices[id as usize], id }));
            }
            Solid::Cylinder { radius, half_length } => {
                if direction.y.abs() >= CAP_COSINE {
                    cap(*radius, half_length.copysign(direction.y), to);
                } else {
                    let side = Vec3::new(direction.x, 0.0, direction.z).normalize_or(Vec3::X);
                    (to.normal, to.face, to.radius) = (side, 0, *radius);
                    for (id, y) in [(0, -half_length), (1, *half_length)] {
                        to.corners.push(Corner { at: side * *radius + Vec3::Y * y, id });
                    }
                }
            }
            Solid::Segment { ends } => {
                (to.normal, to.face) = (direction, 0);
                to.corners.extend(ends.iter().zip(0..).map(|(&at, id)| Corner { at, id }));
            }
        }
    }

    /// The rim of the cap that a cylinder shows in a direction.
    pub fn rim(&self, direction: Vec3) -> Option<Rim> {
        let Solid::Cylinder { radius, half_length } = *self else { return None };
        let sine = Vec3::new(direction.x, 0.0, direction.z).length();
        if direction.y.abs() < CAP_COSINE || sine == 0.0 {
            return None;
        }
        Some(Rim { at: farthest(radius, half_length.copysign(direction.y), direction), sine, radius })
    }
}

/// The rim of a cylinder's cap and a direction.
#[derive(Clone, Copy, Debug)]
pub struct Rim {
    /// Its farthest point along the direction, m.
    pub at: Vec3,
    /// Sine of the angle between the direction and the axis.
    pub sine: f64,
    /// m
    pub radius: f64,
}

/// The point of a circle about the y axis, at this height, that is farthest along a direction.
pub(crate) fn farthest(radius: f64, y: f64, direction: Vec3) -> Vec3 {
    let across = Vec3::new(direction.x, 0.0, direction.z);
    across.normalize_or_zero() * radius + Vec3::Y * y
}

/// Id of the rim's lowest point among a cylinder's corners.
pub(crate) const RIM: u32 = 4 * CAP_CORNERS as u32;

/// Cosines and sines of the corners of a cap; one quarter only, so that rounding keeps the symmetry.
const QUARTER: [(f64, f64); CAP_CORNERS / 4] = [
    (1.0, 0.0),
    (0.923_879_532_511_286_7, 0.382_683_432_365_089_8),
    (std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2),
    (0.382_683_432_365_089_8, 0.923_879_532_511_286_7),
];

fn cap(radius: f64, y: f64, to: &mut Feature) {
    let top = y > 0.0;
    (to.normal, to.face) = (Vec3::Y * 1f64.copysign(y), 1 + u32::from(top));
    for k in 0..CAP_CORNERS {
        let (c, s) = QUARTER[k % QUARTER.len()];
        let (x, z) = match k / QUARTER.len() {
            0 => (c, s),
            1 => (-s, c),
            2 => (-c, -s),
            _ => (s, -c),
        };
        let id = (2 + k + if top { CAP_CORNERS } else { 0 }) as u32;
        to.corners.push(Corner { at: Vec3::new(radius * x, y, radius * z), id });
    }
}

impl Polytope {
    /// A box of these half extents, m.
    pub fn cuboid(half: Vec3) -> Polytope {
        let sign = |bit: usize| if bit == 0 { -1.0 } else { 1.0 };
        let vertices = (0..8).map(|k| half * Vec3::new(sign(k & 1), sign(k & 2), sign(k & 4))).collect();
        let (mut faces, mut corners) = (Vec::new(), Vec::new());
        // Around the axis, counterclockwise as seen from outside.
        for axis in 0..3usize {
            let (u, v) = (1u32 << ((axis + 1) % 3), 1u32 << ((axis + 2) % 3));
            for (up, normal) in [(1u32, 1.0), (0, -1.0)] {
                let at = up << axis;
                let ring = if up == 1 { [0, u, u | v, v] } else { [0, v, u | v, u] };
                let normal = Vec3::AXES[axis] * normal;
                faces.push(Face { normal, offset: half[axis], first: corners.len() as u32, count: 4 });
                corners.extend(ring.map(|bits| at | bits));
            }
        }
        Polytope { vertices, faces, corners, rounding_m: ON_PLANE * half.length() }
    }

    /// The hull of points; faces that are equal up to rounding are merged. Points that span no volume have no
    /// faces.
    pub fn hull(points: &[Vec3]) -> Polytope {
        let (vertices, triangles) = try_convex_hull(points).unwrap_or_default();
        let center = vertices.iter().copied().sum::<Vec3>() / vertices.len().max(1) as f64;
        let size = vertices.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        let mut polytope =
            Polytope { vertices, faces: Vec::new(), corners: Vec::new(), rounding_m: ON_PLANE * size };
        let mut spans: Vec<(Vec3, [u32; 3])> = triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|k| polytope.vertices[k as usize]);
                ((b - a).cross(c - a), *triangle)
            })
            .collect();
        // Large triangles give the most accurate planes.
        spans.sort_by(|(a, _), (b, _)| b.length_squared().total_cmp(&a.length_squared()));
        for (span, triangle) in &spans {
            let Some(normal) = span.try_normalize() else { continue };
            let known = |face: &Face| {
                let corners = polytope.corners(face);
                triangle.iter().all(|corner| corners.contains(corner)) && face.normal.dot(normal) > 0.0
            };
            if !polytope.faces.iter().any(known) {
                let offset = normal.dot(polytope.vertices[triangle[0] as usize]);
                polytope.add_face(normal, offset, COPLANAR * size);
            }
        }
        polytope
    }

    /// Adds the face of a plane, with all corners on it in order.
    fn add_face(&mut self, normal: Vec3, offset: f64, within: f64) {
        let on = |p: &Vec3| (normal.dot(*p) - offset).abs() <= within;
        let corners: Vec<u32> =
            (0..self.vertices.len() as u32).filter(|&k| on(&self.vertices[k as usize])).collect();
        let center = corners.iter().map(|&k| self.vertices[k as usize]).sum::<Vec3>() / corners.len() as f64;
        let t1 = normal.any_orthonormal_vector();
        let t2 = normal.cross(t1);
        let angle = |k: u32| {
            let arm = self.vertices[k as usize] - center;
            libm::atan2(arm.dot(t2), arm.dot(t1))
        };
        let mut ring: Vec<(f64, u32)> = corners.iter().map(|&k| (angle(k), k)).collect();
        ring.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, count) = (self.corners.len() as u32, ring.len() as u32);
        self.corners.extend(ring.iter().map(|(_, k)| k));
        self.faces.push(Face { normal, offset, first, count });
    }

    /// Indices of a face's corners among the vertices.
    pub fn corners(&self, face: &Face) -> &[u32] {
        &self.corners[face.first as usize..][..face.count as usize]
    }

    /// The face that faces a direction best; among those with the point `at` on them, if there are any.
    fn facing(&self, direction: Vec3, at: Option<Vec3>) -> usize {
        let best = |admits: &dyn Fn(&Face) -> bool| {
            let (mut best, mut most) = (None, f64::NEG_INFINITY);
            for (k, face) in self.faces.iter().enumerate() {
                let along = face.normal.dot(direction);
                if along > most && admits(face) {
                    (best, most) = (Some(k), along);
                }
            }
            best
        };
        let near = at.and_then(|at| {
            best(&|face: &Face| (face.normal.dot(at) - face.offset).abs() <= 10.0 * self.rounding_m)
        });
        near.or_else(|| best(&|_: &Face| true)).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_is_as_wide_as_between_its_nearest_faces_however_it_lies() {
        let turn = palmares_models::Rotation::from_scaled_axis(Vec3::new(0.3, 0.7, -0.4));
        let cuboid = Polytope::cuboid(Vec3::new(0.3, 5e-4, 0.2));
        assert!((Solid::Polytope(cuboid.clone()).width() - 1e-3).abs() < 1e-15);
        let turned: Vec<Vec3> = cuboid.vertices.iter().map(|vertex| turn * *vertex).collect();
        assert!((Solid::Polytope(Polytope::hull(&turned)).width() - 1e-3).abs() < 1e-9);
        assert_eq!(Solid::Cylinder { radius: 0.01, half_length: 2e-3 }.width(), 4e-3);
    }
}
