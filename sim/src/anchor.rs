//! Memory of a contact from step to step: stiction without creep.
//!
//! Regularised friction alone creeps: it needs a slip speed to give a force. A stiction anchor is a spring of stiffness
//! k_t, N/m (`Config::anchor_stiffness`), with a damper k_t τ in parallel (τ = `Config::contact_dissipation_s`, s), both in
//! series with Coulomb's slider:
//!
//! `f = −k_t (x + τ ẋ)`, `|f| ≤ μ f_n`
//!
//! with the stretch x, m, and the friction f, N, on body B in the tangent plane; x is the elastic displacement of B against A,
//! so that f opposes it. At rest ẋ = 0 and the stretch carries the force: the slip speed is zero. The anchor belongs to
//! parry's contact point and follows it through parry's matching of points by feature.

use crate::digest::Digest;
use palmares_models::{Pose, Vec3};
use parry3d_f64::query::{ContactManifold, TrackedContact};
use serde::{Deserialize, Serialize};

/// The flat face that gives a contact's normal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Facing {
    /// No face: edges, or curved sides, meet.
    #[default]
    None,
    /// Face of the first shape, by index.
    First(u32),
    /// Face of the second shape, by index.
    Second(u32),
}

impl Facing {
    /// The face, if it is the first shape's.
    pub(crate) fn of_first(self) -> Option<u32> {
        if let Facing::First(face) = self { Some(face) } else { None }
    }

    /// The face, if it is the second shape's.
    pub(crate) fn of_second(self) -> Option<u32> {
        if let Facing::Second(face) = self { Some(face) } else { None }
    }

    pub(crate) fn code(self) -> u64 {
        match self {
            Facing::None => 0,
            Facing::First(face) => u64::from(face) << 2 | 1,
            Facing::Second(face) => u64::from(face) << 2 | 2,
        }
    }
}

/// Memory of one contact point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// parry's point existed in an earlier step. A new point takes over the memory of the points it replaces.
    pub known: bool,
    /// The point was under load in the last step.
    pub loaded: bool,
    /// Elastic tangential displacement of body B against A, in the frame of the pair's first shape, m.
    pub stretch: Vec3,
    /// Elastic turn about the normal of B against A at the arm of spin ([`spin`](crate::surface::spin)), m.
    pub twist: f64,
    /// Speed of slip in the last step, m/s.
    pub slip: f64,
    /// Normal force in the last step, N.
    pub normal_force: f64,
    /// Normal force averaged over the last [`BEARING_S`], N: the mean share of a point in a patch that
    /// chatters.
    pub bearing: f64,
    /// Dissipation time that a dead blow has left, s; 0 without one (`step/dead_blow.rs`).
    pub struck_s: f64,
}

/// Time over which the bearing is averaged, s: longer than a period of chatter, shorter than rocking.
const BEARING_S: f64 = 5e-3;

/// Bodies that turn against each other by more than this in a step roll, rad: their points do not stay.
const ROLLS_RAD: f64 = 1e-4;

/// Memory of a pair of shapes. The state keeps only pairs that remember something.
#[derive(Serialize, Deserialize)]
pub struct Pair {
    /// Collider indices, the lower one first.
    pub key: (u32, u32),
    /// parry's contact points.
    pub manifold: ContactManifold<(), Anchor>,
    /// Start value of a new point: the mean over the pair's loaded points.
    pub mean: Anchor,
    /// The shape whose face gives the contact's normal.
    pub facing: Facing,
    /// Every point would need a covered face: the points are known, but they are no contact.
    pub covered: bool,
    /// Distance of friction from the middle of the points, as a part of the points' own distance: see
    /// [`manifold`](crate::contact::manifold).
    pub lever: f64,
    /// Overlap that was there when the shapes were first found, m. It counts as touching and is removed
    /// slowly.
    pub initial_overlap: f64,
    /// Gap of the deepest point at the last update of the points, m, and the pose of B in A's frame then; 0
    /// and identity for a pair without points.
    pub updated_at: (f64, Pose),
    /// Linear and angular displacement of B against A that the last step's velocities would make, m and rad, in the frame of
    /// A and at its origin; `None` if the poses have been changed from outside, or no point bears.
    pub predicted: Option<[Vec3; 2]>,
    /// Tangential displacement of the bearing points, beside that of the velocities, in the last step, m, in the frame of A.
    pub beside: Vec3,
    /// The poses have been changed from outside since the last step.
    pub placed: bool,
}

impl Clone for Pair {
    fn clone(&self) -> Self {
        let Pair {
            key,
            manifold,
            mean,
            facing,
            covered,
            lever,
            initial_overlap,
            updated_at,
            predicted,
            beside,
            placed,
        } = self;
        Pair {
            key: *key,
            facing: *facing,
            covered: *covered,
            lever: *lever,
            manifold: manifold.clone(),
            mean: *mean,
            initial_overlap: *initial_overlap,
            updated_at: *updated_at,
            predicted: *predicted,
            beside: *beside,
            placed: *placed,
        }
    }

    /// Keeps the allocated list of points.
    fn clone_from(&mut self, from: &Self) {
        let Pair {
            key,
            manifold,
            mean,
            facing,
            covered,
            lever,
            initial_overlap,
            updated_at,
            predicted,
            beside,
            placed,
        } = from;
        let ContactManifold { points, local_n1, local_n2, subshape1, subshape2, subshape_poses, data: () } =
            manifold;
        self.key = *key;
        self.manifold.points.clone_from(points);
        (self.manifold.local_n1, self.manifold.local_n2) = (*local_n1, *local_n2);
        (self.manifold.subshape1, self.manifold.subshape2) = (*subshape1, *subshape2);
        self.manifold.subshape_poses.clone_from(subshape_poses);
        (self.mean, self.facing, self.covered, self.lever) = (*mean, *facing, *covered, *lever);
        (self.initial_overlap, self.updated_at) = (*initial_overlap, *updated_at);
        (self.predicted, self.beside, self.placed) = (*predicted, *beside, *placed);
    }
}

impl Anchor {
    /// Anchor of a point without load.
    pub const IDLE: Anchor = Anchor {
        known: true,
        loaded: false,
        stretch: Vec3::ZERO,
        twist: 0.0,
        slip: 0.0,
        normal_force: 0.0,
        bearing: 0.0,
        struck_s: 0.0,
    };

    /// Lets the springs of stiction go.
    pub(crate) fn let_go(&mut self) {
        (self.stretch, self.twist) = (Vec3::ZERO, 0.0);
    }

    /// Bearing after a step of `h` with this normal force.
    pub(crate) fn bearing_after(&self, normal_force: f64, h: f64) -> f64 {
        self.bearing + (normal_force - self.bearing) * (h / (h + BEARING_S))
    }

    fn is_bounded(&self) -> bool {
        let Anchor { known: _, loaded: _, stretch, twist, slip, normal_force, bearing, struck_s } = self;
        bounded_vector(*stretch) && bounded(&[*twist, *slip, *normal_force, *bearing, *struck_s])
    }

    fn digest(&self, h: &mut Digest) {
        let Anchor { known, loaded, stretch, twist, slip, normal_force, bearing, struck_s } = self;
        h.word(u64::from(*known) << 1 | u64::from(*loaded));
        h.vector(*stretch);
        h.floats(&[*twist, *slip, *normal_force, *bearing, *struck_s]);
    }
}

/// Largest magnitude of a number in a contact's memory, m, m/s or N: its square times any stiffness is still
/// finite.
const MAX_MAGNITUDE: f64 = 1e15;

fn bounded(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| x.abs() <= MAX_MAGNITUDE)
}

fn bounded_vector(v: Vec3) -> bool {
    bounded(&v.to_array())
}

impl Pair {
    /// A pair that has not touched yet.
    pub fn new(key: (u32, u32)) -> Self {
        Pair {
            key,
            manifold: ContactManifold::new(),
            mean: Anchor::default(),
            facing: Facing::None,
            covered: false,
            lever: 0.0,
            initial_overlap: 0.0,
            updated_at: (0.0, Pose::IDENTITY),
            predicted: None,
            beside: Vec3::ZERO,
            placed: false,
        }
    }

    /// The poses of its bodies have been changed from outside.
    pub(crate) fn place(&mut self) {
        (self.predicted, self.beside, self.placed) = (None, Vec3::ZERO, true);
    }

    /// Adds to the anchors that stuck in the last step the part of their displacement that the step did not know, now that B is at
    /// `a_from_b`. Velocities are tangents of the motion: without this, an object on a palm that turns by ω h in a step would creep
    /// outwards by (ω h)² r/2, and its anchor would not know. The next step expects the same displacement beside its velocities.
    pub(crate) fn follow(&mut self, a_from_b: &Pose) {
        let together = |turn: Vec3| turn.length_squared() <= ROLLS_RAD * ROLLS_RAD;
        let Some([linear, angular]) = self.predicted.take().filter(|[_, turn]| together(*turn)) else {
            self.beside = Vec3::ZERO;
            return;
        };
        let moved = *a_from_b * self.updated_at.1.inverse();
        let (normal, expected) = (self.manifold.local_n1, self.beside);
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for point in self.manifold.points.iter_mut().filter(|point| point.data.loaded) {
            let (at, sticks) = (point.local_p1, point.data.slip == 0.0);
            let known = linear + angular.cross(at);
            let beside = moved.transform_point(at) - at - known;
            let beside = beside - normal * beside.dot(normal);
            if sticks {
                point.data.stretch += beside - expected;
            }
            // Friction of bodies that slide follows their velocities.
            if sticks || (known - normal * known.dot(normal)).length_squared() <= beside.length_squared() {
                sum += beside;
                count += 1.0;
            }
        }
        self.beside = if count > 0.0 { sum / count } else { Vec3::ZERO };
    }

    /// Whether there is nothing to remember. parry starts its search from the normals, so they count.
    pub(crate) fn is_blank(&self) -> bool {
        // Without points neither face nor lever is known.
        let Pair {
            key: _,
            manifold,
            mean,
            facing: _,
            covered: _,
            lever: _,
            initial_overlap,
            updated_at: _,
            predicted: _,
            beside: _,
            placed: _,
        } = self;
        manifold.points.is_empty()
            && manifold.local_n1 == Vec3::ZERO
            && manifold.local_n2 == Vec3::ZERO
            && *mean == Anchor::default()
            && *initial_overlap == 0.0
    }

    /// Whether every number is possible for a pair that was stepped.
    pub(crate) fn is_bounded(&self) -> bool {
        let Pair {
            key: _,
            manifold,
            mean,
            facing: _,
            covered: _,
            lever,
            initial_overlap,
            updated_at: (gap, a_from_b),
            predicted,
            beside,
            placed: _,
        } = self;
        let of_point = |point: &TrackedContact<Anchor>| {
            bounded_vector(point.local_p1)
                && bounded_vector(point.local_p2)
                && bounded(&[point.dist])
                && point.data.is_bounded()
        };
        bounded(&[*initial_overlap, *gap, *lever])
            && a_from_b.is_finite()
            && bounded_vector(a_from_b.translation)
            && bounded_vector(manifold.local_n1)
            && bounded_vector(manifold.local_n2)
            && mean.is_bounded()
            && predicted.iter().flatten().chain([beside]).all(|part| bounded_vector(*part))
            && manifold.points.iter().all(of_point)
    }

    pub(crate) fn digest(&self, h: &mut Digest) {
        // Destructured by name, so that nothing can be forgotten; for convex shapes the rest is empty.
        let Pair {
            key,
            manifold,
            mean,
            facing,
            covered,
            lever,
            initial_overlap,
            updated_at: (gap, a_from_b),
            predicted,
            beside,
            placed,
        } = self;
        let ContactManifold { points, local_n1, local_n2, subshape1, subshape2, subshape_poses: _, data: () } =
            manifold;
        h.word(u64::from(key.0) << 32 | u64::from(key.1));
        h.word(u64::from(*subshape1) << 32 | u64::from(*subshape2));
        h.vector(*local_n1);
        h.vector(*local_n2);
        h.word(facing.code() << 1 | u64::from(*covered));
        h.float(*lever);
        h.float(*initial_overlap);
        h.float(*gap);
        h.pose(a_from_b);
        h.word(u64::from(predicted.is_some()) << 1 | u64::from(*placed));
        predicted.iter().flatten().for_each(|part| h.vector(*part));
        h.vector(*beside);
        mean.digest(h);
        h.word(points.len() as u64);
        for TrackedContact { local_p1, local_p2, dist, fid1, fid2, data } in points {
            h.vector(*local_p1);
            h.vector(*local_p2);
            h.float(*dist);
            h.word(u64::from(fid1.0) << 32 | u64::from(fid2.0));
            data.digest(h);
        }
    }
}

/// Elastic stretch after a step in which the friction impulse was `impulse` (tangential, on body B).
///
/// The force is that of spring and damper in parallel, `f = −k_t (x + τ ẋ)`, in series with Coulomb slip;
/// eliminating ẋ = (x₁ − x₀)/h gives `x₁ = (−f/k_t + x₀ τ/h) / (1 + τ/h)`, which is x₀ + h·v when sticking.
#[inline]
pub fn stretch_after(before: Vec3, impulse: Vec3, stiffness: f64, dissipation_s: f64, h: f64) -> Vec3 {
    let ratio = dissipation_s / h;
    (impulse * (-1.0 / (h * stiffness)) + before * ratio) / (1.0 + ratio)
}

/// Elastic stretch `x₁` of a contact that slid in the step: along the line of the friction impulse, and no
/// longer than the spring alone would hold it, `0 ≤ x·(−f̂) ≤ |f|/k_t`. Otherwise a spring stretched by an
/// impact, or by slip in another direction, relaxes over the dissipation time and meanwhile turns friction
/// away from the slip. The rule only shortens the spring, so that energy is lost.
/// spring: energy is lost.
#[inline]
pub fn stretch_sliding(stretch: Vec3, impulse: Vec3, stiffness: f64, h: f64) -> Vec3 {
    let size = impulse.length();
    // Also covers a solve that ended in NaN, whose step is discarded.
    if size.is_nan() || size == 0.0 {
        return Vec3::ZERO;
    }
    let along = impulse * (-1.0 / size);
    along * stretch.dot(along).clamp(0.0, size / (h * stiffness))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sliding_spring_turns_into_friction_and_never_grows() {
        let impulse = Vec3::new(-2.0e-3, 0.0, 0.0);
        let (k, h) = (2e5, 1e-3);
        let most = 1e-5;
        for (x, y) in [(0.5e-5, 0.0), (0.5e-5, 3e-5), (8e-5, -1e-5), (-2e-5, 1e-5)] {
            let before = Vec3::new(x, y, 0.0);
            let after = stretch_sliding(before, impulse, k, h);
            assert!(after.y == 0.0 && after.x >= 0.0 && after.x <= most * (1.0 + 1e-15));
            assert!(after.length() <= before.length());
        }
        assert_eq!(stretch_sliding(Vec3::X, Vec3::ZERO, k, h), Vec3::ZERO);
    }
}
