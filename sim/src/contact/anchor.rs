//! What a contact remembers from step to step.
//!
//! Regularised friction alone creeps. A stiction anchor is a tangential spring of stiffness k_t that starts
//! where the contact first stuck; its stretch carries the friction force of a contact at rest, so that the
//! slip speed at rest is zero. The anchor belongs to parry's contact point and follows it through parry's
//! matching of points by feature.

use crate::state::Digest;
use palmares_models::{Pose, Vec3};
use parry3d_f64::query::ContactManifold;

/// Memory of one contact point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anchor {
    /// parry's point was there in an earlier step. A point that is not takes over from the points it replaces.
    pub known: bool,
    /// The point was under load in the last step.
    pub loaded: bool,
    /// Elastic tangential displacement of body B against A, in the frame of the pair's first shape, m.
    pub stretch: Vec3,
    /// Speed of slip in the last step, m/s.
    pub slip: f64,
    /// Normal force in the last step, N.
    pub normal_force: f64,
}

/// Memory of a pair of shapes.
#[derive(Clone)]
pub struct Pair {
    /// Collider indices, the lower one first.
    pub key: (u32, u32),
    /// The shapes' bounds overlapped in the last step; otherwise the rest is blank.
    pub active: bool,
    /// parry's contact points.
    pub manifold: ContactManifold<(), Anchor>,
    /// What a newly found point starts from: the mean over the pair's loaded points.
    pub mean: Anchor,
    /// The shapes were known to be this far apart, m, ...
    pub gap: f64,
    /// ... when B stood here in A's frame. No gap is known at first.
    pub gap_pose: Pose,
    /// Overlap that the contact did not bring about, m: the shapes were first seen in each other. It counts as
    /// touching and is taken back slowly.
    pub excess: f64,
}

impl Anchor {
    /// Of a point that carries nothing.
    pub const IDLE: Anchor =
        Anchor { known: true, loaded: false, stretch: Vec3::ZERO, slip: 0.0, normal_force: 0.0 };
}

impl Pair {
    /// A pair that has not touched yet.
    pub fn new(key: (u32, u32)) -> Self {
        Pair {
            key,
            active: false,
            manifold: ContactManifold::new(),
            mean: Anchor::default(),
            gap: 0.0,
            gap_pose: Pose::IDENTITY,
            excess: 0.0,
        }
    }

    /// Forgets everything: the shapes have parted.
    pub fn clear(&mut self) {
        if self.active {
            self.active = false;
            self.manifold.points.clear();
            self.manifold.local_n1 = Vec3::ZERO;
            self.manifold.local_n2 = Vec3::ZERO;
            self.mean = Anchor::default();
            self.gap = 0.0;
            self.excess = 0.0;
        }
    }

    pub(crate) fn digest(&self, h: &mut Digest) {
        h.word(u64::from(self.key.0) << 32 | u64::from(self.key.1));
        h.vector(self.manifold.local_n1);
        h.floats(&[self.excess]);
        for point in &self.manifold.points {
            h.vector(point.local_p1);
            h.vector(point.local_p2);
            h.vector(point.data.stretch);
            h.floats(&[point.dist, point.data.slip, point.data.normal_force]);
            h.word(u64::from(point.data.known) << 1 | u64::from(point.data.loaded));
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
