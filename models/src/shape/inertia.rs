//! Mass properties of shapes, in closed form where there is one.
//!
//! Own formulas, because rounding matters at fingertip size (a third of a phalanx is rounding) and because
//! these sums end up in every run's hash: additions, products and square roots only.

use core::f64::consts::PI;

use parry3d_f64::transformation::try_convex_hull;

use super::Shape;
use super::support::{fibonacci_direction, support};
use crate::{Mat3, Pose, Vec3};

/// Number of directions that approximate a rounded hull: its volume is then within a few parts in a thousand.
const ROUNDED_HULL_DIRECTIONS: usize = 1024;

/// Mass properties of a rigid body, in the frame of its link or shape.
#[derive(Clone, Copy, Debug)]
pub struct Inertia {
    /// kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub com: Vec3,
    /// Rotational inertia about the centre of mass, in the axes of the frame, kg·m².
    pub about_com: Mat3,
}

/// ∫dV, ∫x dV and ∫x xᵀ dV of a solid.
#[derive(Clone, Copy, Debug)]
struct Moments {
    volume: f64,
    first: Vec3,
    second: Mat3,
}

/// a bᵀ.
fn outer(a: Vec3, b: Vec3) -> Mat3 {
    Mat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl Moments {
    /// Mass properties of `mass` kg spread evenly; `None` without a volume.
    fn inertia(&self, mass: f64) -> Option<Inertia> {
        if self.volume == 0.0 {
            return None;
        }
        let density = mass / self.volume;
        let com = self.first / self.volume;
        let second = (self.second - outer(com, com) * self.volume) * density;
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        Some(Inertia { mass, com, about_com: Mat3::from_diagonal(Vec3::splat(trace)) - second })
    }

    const ZERO: Moments = Moments { volume: 0.0, first: Vec3::ZERO, second: Mat3::ZERO };

    fn centred(volume: f64, second: [f64; 3]) -> Moments {
        Moments { volume, first: Vec3::ZERO, second: Mat3::from_diagonal(Vec3::from_array(second)) }
    }

    /// The same solid expressed in frame a, given a_from_b.
    fn moved(&self, a_from_b: &Pose) -> Moments {
        let (r, t) = (Mat3::from_quat(a_from_b.rotation), a_from_b.translation);
        let first = r * self.first;
        Moments {
            volume: self.volume,
            first: first + t * self.volume,
            second: r * self.second * r.transpose()
                + outer(first, t)
                + outer(t, first)
                + outer(t, t) * self.volume,
        }
    }

    fn plus(&self, other: &Moments) -> Moments {
        Moments {
            volume: self.volume + other.volume,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }
}

/// Moments of a shape in its own frame; `None` without volume.
fn moments(shape: &Shape) -> Option<Moments> {
    let m = match shape {
        Shape::Sphere { radius: r } => rounded_box([0.0; 3], *r),
        Shape::Capsule { radius: r, half_length: l } => rounded_box([0.0, 0.0, *l], *r),
        Shape::Cylinder { radius: r, half_length: l } => {
            let volume = PI * r * r * 2.0 * l;
            Moments::centred(volume, [volume * r * r / 4.0, volume * r * r / 4.0, volume * l * l / 3.0])
        }
        Shape::Box { half_extents, rounding } => rounded_box(half_extents.map(|x| x - rounding), *rounding),
        Shape::Hull { points, rounding } => {
            let points: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(*p)).collect();
            if *rounding > 0.0 {
                let grown: Vec<Vec3> = (0..ROUNDED_HULL_DIRECTIONS)
                    .map(|i| fibonacci_direction(i, ROUNDED_HULL_DIRECTIONS))
                    .filter_map(|d| Some(support(&points, d)? + d * *rounding))
                    .collect();
                polytope(&grown)?
            } else {
                polytope(&points)?
            }
        }
    };
    // The hull of points in one plane has two faces with only rounding errors between them.
    (m.volume > 1e-15).then_some(m)
}

/// Box of half extents `inner` grown by a ball of radius r: a box, six slabs, twelve quarter cylinders and
/// eight eighths of a ball. A ball and a capsule are the cases where extents vanish.
fn rounded_box(inner: [f64; 3], r: f64) -> Moments {
    let [a, b, c] = inner;
    let volume = 8.0 * a * b * c
        + 8.0 * r * (a * b + b * c + c * a)
        + 2.0 * PI * r * r * (a + b + c)
        + 4.0 / 3.0 * PI * r * r * r;
    // ∫x² dV along one axis with half extent a; b and c are the two others.
    let along = |a: f64, b: f64, c: f64| {
        let outward = a + r;
        let box_and_side_slabs = (8.0 * a * b * c + 8.0 * a * r * (b + c)) * a * a / 3.0;
        let end_slabs = 8.0 * b * c * (outward * outward * outward - a * a * a) / 3.0;
        let edges_along = PI * r * r * 2.0 * a * a * a / 3.0;
        // Over a disc: ∫(a + |u|)² dA; over a ball: ∫(a + |u|)² dV.
        let disc = PI * r * r * a * a + 8.0 * a * r * r * r / 3.0 + PI * r * r * r * r / 4.0;
        let ball =
            4.0 / 3.0 * PI * r * r * r * a * a + PI * r * r * r * r * a + 4.0 / 15.0 * PI * r * r * r * r * r;
        box_and_side_slabs + end_slabs + edges_along + 2.0 * (b + c) * disc + ball
    };
    Moments::centred(volume, [along(a, b, c), along(b, c, a), along(c, a, b)])
}

/// Convex hull of points.
fn polytope(points: &[Vec3]) -> Option<Moments> {
    let (vertices, faces) = try_convex_hull(points).ok()?;
    Some(enclosed(&vertices, &faces))
}

/// Moments of the volume that triangles enclose: tetrahedra between the origin and each of them.
fn enclosed(vertices: &[Vec3], faces: &[[u32; 3]]) -> Moments {
    let mut sum = Moments::ZERO;
    for face in faces {
        let [a, b, c] = face.map(|i| vertices[i as usize]);
        let volume = a.dot(b.cross(c)) / 6.0;
        let s = a + b + c;
        // ∫x xᵀ over a tetrahedron (0, a, b, c) = V/20 (a aᵀ + b bᵀ + c cᵀ + s sᵀ).
        let second = (outer(a, a) + outer(b, b) + outer(c, c) + outer(s, s)) * (volume / 20.0);
        sum = sum.plus(&Moments { volume, first: s * (volume / 4.0), second });
    }
    sum
}

/// Volume of a closed mesh, m³, by the divergence theorem; negative if its triangles face inward.
pub(crate) fn volume_of_triangles(vertices: &[Vec3], faces: &[[u32; 3]]) -> f64 {
    // Relative to a point of the mesh: it may be far from the origin.
    let Some(origin) = vertices.first() else { return 0.0 };
    let six_fold = faces.iter().map(|face| {
        let [a, b, c] = face.map(|i| vertices[i as usize] - *origin);
        a.dot(b.cross(c))
    });
    six_fold.sum::<f64>() / 6.0
}

/// Mass properties of `mass` kg spread evenly over the volume of a closed mesh.
pub(crate) fn of_triangles(vertices: &[Vec3], faces: &[[u32; 3]], mass: f64) -> Option<Inertia> {
    let origin = *vertices.first()?;
    let moved: Vec<Vec3> = vertices.iter().map(|v| *v - origin).collect();
    let inertia = enclosed(&moved, faces).inertia(mass)?;
    Some(Inertia { com: inertia.com + origin, ..inertia })
}

/// Volume of a shape, m³; 0 if it is flat. For a rounded hull, accurate to a few parts in a thousand.
pub fn volume(shape: &Shape) -> f64 {
    moments(shape).map_or(0.0, |m| m.volume)
}

/// Mass properties of `mass` kg spread evenly over the volume of shapes; overlaps count twice.
/// `None` when the shapes have no volume.
pub fn of_shapes<'a>(parts: impl IntoIterator<Item = (Pose, &'a Shape)>, mass: f64) -> Option<Inertia> {
    let mut sum = Moments::ZERO;
    for (pose, shape) in parts {
        sum = sum.plus(&moments(shape)?.moved(&pose));
    }
    (sum.volume > 0.0).then(|| sum.inertia(mass)).flatten()
}

impl Inertia {
    /// No mass.
    pub const ZERO: Inertia = Inertia { mass: 0.0, com: Vec3::ZERO, about_com: Mat3::ZERO };

    /// The same body expressed in frame a, given a_from_b.
    pub fn moved(&self, a_from_b: &Pose) -> Inertia {
        let r = Mat3::from_quat(a_from_b.rotation);
        Inertia {
            mass: self.mass,
            com: a_from_b.transform_point(self.com),
            about_com: r * self.about_com * r.transpose(),
        }
    }

    /// Both bodies rigidly joined (parallel axis theorem).
    pub fn plus(&self, other: &Inertia) -> Inertia {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return Inertia::ZERO;
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let shift = |body: &Inertia| {
            let d = body.com - com;
            body.about_com + (Mat3::from_diagonal(Vec3::splat(d.dot(d))) - outer(d, d)) * body.mass
        };
        Inertia { mass, com, about_com: shift(self) + shift(other) }
    }

    /// Principal moments, ascending, kg·m².
    pub fn principal(&self) -> [f64; 3] {
        let m = nalgebra::Matrix3::from_column_slice(&self.about_com.to_cols_array());
        let e = m.symmetric_eigenvalues();
        let mut e = [e[0], e[1], e[2]];
        e.sort_by(f64::total_cmp);
        e
    }

    /// The reason why no rigid body has this inertia; `None` if it is plausible.
    pub fn implausible(&self) -> Option<String> {
        let [a, b, c] = self.principal();
        if !(self.mass.is_finite() && self.com.is_finite() && c.is_finite()) {
            Some("is not finite".to_owned())
        } else if a < -1e-9 * c.abs() {
            Some(format!("has the negative principal moment {a:.3e} kg·m²"))
        } else if a + b < c * (1.0 - 1e-6) {
            Some(format!("violates the triangle inequality: {a:.3e} + {b:.3e} < {c:.3e} kg·m²"))
        } else {
            None
        }
    }
}
