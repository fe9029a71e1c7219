//! The data of an island's minimisation problem.

use super::friction_cone::{ConeLaw, RollingLaw};
use super::terms::{AxisTerm, RowTerm};
use crate::dynamics::pattern::{columns, row_sum_abreast};
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Model, Owner};
use palmares_models::{Mat3, Rotation, Vec3};

/// Contact point in the iteration.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Position from the pair's origin, m.
    pub r: Vec3,
    /// Point at which friction acts, from the pair's origin, m.
    pub friction_r: Vec3,
    /// Contact axes: two tangents and the normal; spin is about the normal.
    pub axes: [Vec3; 3],
    /// Its friction law.
    pub law: ConeLaw,
    /// Impulse on body B in contact axes.
    pub impulse: [f64; 4],
    /// Contact velocity; for spin, at the law's arm.
    pub velocity: [f64; 4],
    pub(super) direction: [f64; 4],
}

impl Point {
    /// A point before its first iteration.
    pub fn new(r: Vec3, friction_r: Vec3, axes: [Vec3; 3], law: ConeLaw) -> Self {
        Point { r, friction_r, axes, law, impulse: [0.0; 4], velocity: [0.0; 4], direction: [0.0; 4] }
    }

    #[inline]
    pub(super) fn project(&self, relative: SpatialVelocity, patch: bool) -> [f64; 4] {
        let [t1, t2, n] = self.axes;
        let v = relative.at(self.r);
        if !patch {
            return [t1.dot(v), t2.dot(v), n.dot(v), 0.0];
        }
        let across = relative.at(self.friction_r);
        [t1.dot(across), t2.dot(across), n.dot(v), self.law.arm * n.dot(relative.angular)]
    }

    /// Change of its velocity along the last direction, such as that of [`super::newton::Newton::change_along`].
    pub(crate) fn change(&self) -> [f64; 4] {
        self.direction
    }

    /// Force, N, or impulse on body B in contact axes, as normal part and friction.
    pub(crate) fn parts(&self, [t1, t2, n, _]: [f64; 4]) -> [Vec3; 2] {
        [self.axes[2] * n, self.axes[0] * t1 + self.axes[1] * t2]
    }

    /// Its torque, N·m, or angular impulse on body B about the normal.
    pub(crate) fn torque(&self, [_, _, _, spin]: [f64; 4]) -> Vec3 {
        self.axes[2] * (self.law.arm * spin)
    }
}

/// One of the two bodies of a pair, for the iteration.
#[derive(Clone, Copy, Debug)]
pub(super) enum PairBody {
    /// Furniture.
    Fixed,
    /// A link of the hand, and the vector from the base's origin to the pair's, m.
    Link(usize, Vec3),
    /// An object, by its index in the island, whose centre is the pair's origin.
    Centre(usize),
    /// Another object, and the vector from its centre to the pair's origin, m.
    Object(usize, Vec3),
}

impl PairBody {
    /// The vector from the body's own origin to the pair's, m.
    #[inline]
    pub(super) fn lever(self) -> Vec3 {
        match self {
            PairBody::Fixed | PairBody::Centre(_) => Vec3::ZERO,
            PairBody::Link(_, lever) | PairBody::Object(_, lever) => lever,
        }
    }
}

/// Two bodies in contact.
#[derive(Clone, Debug)]
pub struct PairProblem {
    /// Body A.
    pub a: Owner,
    /// Body B.
    pub b: Owner,
    /// Origin of the pair's spatial quantities in the world, m.
    pub origin: Vec3,
    /// Rolling resistance.
    pub rolling: RollingLaw,
    /// First point in [`Problem::points`].
    pub first: usize,
    /// One past the last.
    pub end: usize,
    /// Whether friction acts at another point than the normal forces, or against spin.
    pub patch: bool,
    pub(super) bodies: [PairBody; 2],
    /// Velocity of B against A at the origin.
    pub(crate) relative: SpatialVelocity,
    pub(super) direction: SpatialVelocity,
}

impl PairProblem {
    /// A pair before its first iteration.
    pub fn new(a: Owner, b: Owner, origin: Vec3, rolling: RollingLaw, first: usize, end: usize) -> Self {
        let (bodies, still) = ([PairBody::Fixed; 2], SpatialVelocity::ZERO);
        PairProblem {
            a,
            b,
            origin,
            rolling,
            first,
            end,
            patch: false,
            bodies,
            relative: still,
            direction: still,
        }
    }
}

/// A free object in an island.
#[derive(Clone, Copy, Debug)]
pub struct ObjectProblem {
    /// Index of the object.
    pub object: usize,
    /// Centre of mass in the world, m.
    pub center: Vec3,
    /// kg
    pub mass: f64,
    /// Inertia about the centre of mass in world axes, at the orientation that the body reaches without
    /// torque.
    pub inertia: Mat3,
    /// Orientation and angular velocity that it reaches without torque; `None` for a body that keeps its own.
    pub turn: Option<(Rotation, Vec3)>,
}

/// An island's minimisation problem. Local velocities: the hand's, if it takes part, then six per object.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// Length of the hand's part; 0 without the hand.
    pub hand_dofs: usize,
    /// Whether the base's velocities are prescribed.
    pub bolted: bool,
    /// A of the hand, row-major.
    pub hand_matrix: Vec<f64>,
    /// The objects, in ascending order.
    pub objects: Vec<ObjectProblem>,
    /// A v*.
    pub momentum: Vec<f64>,
    /// Pairs in contact.
    pub pairs: Vec<PairProblem>,
    /// Their points.
    pub points: Vec<Point>,
    /// Limits and servo of the hand.
    pub axis_terms: Vec<AxisTerm>,
    /// Tendons of the hand.
    pub row_terms: Vec<RowTerm>,
    /// Number of `row_terms` in use.
    pub rows: usize,
    /// Set by each new assembly: bodies, masses and origins of pairs may have changed since the last solve.
    pub fresh: bool,
}

/// `out = A x`
pub(super) fn multiply(model: &Model, problem: &Problem, x: &[f64], out: &mut [f64]) {
    let h = problem.hand_dofs;
    let hand_blocks = if h > 0 { model.hand_clusters() } else { 0 };
    for block in 0..hand_blocks {
        let columns = columns(model.clusters(), block, h);
        let rows = model.clusters()[block].dofs.clone();
        let matrix = &problem.hand_matrix[rows.start * h..rows.end * h];
        for (out, row) in out[rows].iter_mut().zip(matrix.chunks_exact(h)) {
            *out = row_sum_abreast(row, &x[..h], &columns);
        }
    }
    let (x, _) = x[h..].as_chunks::<6>();
    let (out, _) = out[h..].as_chunks_mut::<6>();
    for ((object, x), out) in problem.objects.iter().zip(x).zip(out) {
        let m = object.mass;
        let w = object.inertia * Vec3::new(x[3], x[4], x[5]);
        *out = [m * x[0], m * x[1], m * x[2], w.x, w.y, w.z];
    }
}
