//! Mass properties of geoms and bodies, as MuJoCo computes them.

use nalgebra::DMatrix;
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use std::f64::consts::PI;

use super::mesh::Mesh;
use super::model::{Geom, GeomShape, JointKind, Mass, Model};
use super::principal::principal;

/// Mass properties of a geom in its body's frame; `None` without mass.
pub(crate) fn of_geom(geom: &Geom, meshes: &[Mesh]) -> Option<Mass> {
    let (volume, com, unit) = match &geom.shape {
        GeomShape::Sphere(r) => (4.0 / 3.0 * PI * r * r * r, Vec3::ZERO, diagonal([0.4 * r * r; 3])),
        GeomShape::Capsule(r, half) => capsule(*r, *half),
        GeomShape::Cylinder(r, half) => {
            let across = (3.0 * r * r + 4.0 * half * half) / 12.0;
            (2.0 * PI * r * r * half, Vec3::ZERO, diagonal([across, across, 0.5 * r * r]))
        }
        GeomShape::Box(half) => {
            let [x, y, z] = (*half * *half).to_array();
            (8.0 * half.x * half.y * half.z, Vec3::ZERO, diagonal([y + z, x + z, x + y].map(|s| s / 3.0)))
        }
        GeomShape::Ellipsoid(half) => {
            let [x, y, z] = (*half * *half).to_array();
            let volume = 4.0 / 3.0 * PI * half.x * half.y * half.z;
            (volume, Vec3::ZERO, diagonal([y + z, x + z, x + y].map(|s| s / 5.0)))
        }
        GeomShape::Mesh(index) => meshes[*index].solid()?,
        GeomShape::Other(_) => return None,
    };
    let mass = geom.mass.unwrap_or(geom.density * volume);
    if mass.is_nan() || mass <= 0.0 {
        return None;
    }
    Some(placed(&Mass { mass, com, about_com: unit * mass }, &geom.pose))
}

fn capsule(r: f64, half: f64) -> (f64, Vec3, Mat3) {
    let (tube, ball) = (2.0 * PI * r * r * half, 4.0 / 3.0 * PI * r * r * r);
    let volume = tube + ball;
    let along = tube * 0.5 * r * r + ball * 0.4 * r * r;
    let across = tube * (3.0 * r * r + 4.0 * half * half) / 12.0
        + ball * (0.4 * r * r + half * half + 0.75 * r * half);
    (volume, Vec3::ZERO, diagonal([across / volume, across / volume, along / volume]))
}

fn diagonal([x, y, z]: [f64; 3]) -> Mat3 {
    Mat3::from_cols(Vec3::X * x, Vec3::Y * y, Vec3::Z * z)
}

/// An inertia in the axes of a frame that this rotation maps from the inertia's own.
pub(crate) fn turned(inertia: &Mat3, rotation: Rotation) -> Mat3 {
    let r = Mat3::from_quat(rotation);
    r * *inertia * r.transpose()
}

/// Mass properties in the outer frame of a pose.
pub(crate) fn placed(mass: &Mass, pose: &Pose) -> Mass {
    Mass { mass: mass.mass, com: *pose * mass.com, about_com: turned(&mass.about_com, pose.rotation) }
}

/// The mass of several bodies in one frame together.
pub(crate) fn sum(parts: impl Iterator<Item = Mass>) -> Mass {
    let parts: Vec<Mass> = parts.collect();
    let mass: f64 = parts.iter().map(|part| part.mass).sum();
    if mass == 0.0 {
        return Mass::default();
    }
    let com = parts.iter().fold(Vec3::ZERO, |sum, part| sum + part.com * part.mass) / mass;
    let about_com = parts.iter().fold(Mat3::ZERO, |sum, part| sum + about(part, com));
    Mass { mass, com, about_com }
}

/// Inertia about a point.
pub(crate) fn about(part: &Mass, point: Vec3) -> Mat3 {
    let d = part.com - point;
    let outer = Mat3::from_cols(d * d.x, d * d.y, d * d.z);
    part.about_com + (diagonal([d.length_squared(); 3]) - outer) * part.mass
}

/// An inertia whose principal moments have at least this size.
pub(crate) fn bounded(inertia: &Mat3, least: f64) -> Mat3 {
    let (axes, moments) = principal(inertia);
    let lifted = moments.map(|moment| moment.max(least));
    turned(&diagonal(lifted), axes)
}

/// Largest number of degrees of freedom of a matrix that is inverted; a hand has at most 256 joints.
const MOST_FREEDOMS: usize = 512;

/// How a document accelerates under forces in the start pose: M⁻¹.
#[derive(Clone, Debug)]
pub(crate) struct Response {
    /// First degree of freedom of each joint.
    first: Vec<usize>,
    inverse: Option<DMatrix<f64>>,
}

impl Response {
    pub(crate) fn of(model: &Model) -> Response {
        let poses = model.world_from_bodies(&vec![0.0; model.joints.len()]);
        // Each degree of freedom: its joint, its axis, and the point about which it turns.
        let mut freedoms: Vec<(usize, Vec3, Option<Vec3>)> = Vec::new();
        let mut first = Vec::new();
        for (index, own) in model.joints.iter().enumerate() {
            let (pose, at) = (poses[own.body], poses[own.body] * own.at);
            first.push(freedoms.len());
            match own.kind {
                JointKind::Hinge => freedoms.push((index, pose.rotation * own.axis, Some(at))),
                JointKind::Slide => freedoms.push((index, pose.rotation * own.axis, None)),
                JointKind::Ball => freedoms.extend(Vec3::AXES.map(|axis| (index, axis, Some(at)))),
                JointKind::Free => {
                    freedoms.extend(Vec3::AXES.map(|axis| (index, axis, None)));
                    freedoms.extend(Vec3::AXES.map(|axis| (index, axis, Some(at))));
                }
            }
        }
        let n = freedoms.len();
        if n > MOST_FREEDOMS {
            return Response { first, inverse: None };
        }
        let mut mass: DMatrix<f64> = DMatrix::zeros(n, n);
        for (body, pose) in poses.iter().enumerate().skip(1) {
            let own = placed(&model.bodies[body].inertia, pose);
            let chain = model.chain(body);
            let carried: Vec<usize> = (0..n).filter(|&k| chain.contains(&freedoms[k].0)).collect();
            let motion = |k: usize| match freedoms[k] {
                (_, axis, Some(at)) => (axis.cross(own.com - at), axis),
                (_, axis, None) => (axis, Vec3::ZERO),
            };
            for &i in &carried {
                for &j in &carried {
                    let ((v, w), (u, x)) = (motion(i), motion(j));
                    mass[(i, j)] += own.mass * v.dot(u) + w.dot(own.about_com * x);
                }
            }
        }
        for (k, (index, ..)) in freedoms.iter().enumerate() {
            mass[(k, k)] += model.joints[*index].armature;
        }
        Response { first, inverse: mass.try_inverse() }
    }

    /// Inertia against a force that acts on hinges and slides with these levers: (J M⁻¹ Jᵀ)⁻¹; 0 if nothing resists.
    pub(crate) fn inertia(&self, levers: &[(usize, f64)]) -> f64 {
        let Some(inverse) = &self.inverse else { return 0.0 };
        let yields = |&(i, a): &(usize, f64)| {
            levers.iter().map(|&(j, b)| a * b * inverse[(self.first[i], self.first[j])]).sum::<f64>()
        };
        let sum: f64 = levers.iter().map(yields).sum();
        if sum > 0.0 { 1.0 / sum } else { 0.0 }
    }
}
