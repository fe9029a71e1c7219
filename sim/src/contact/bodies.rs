//! The bodies of a world, how they move, and how far two of their shapes reach.

use super::reach::Reach;
use crate::dynamics::hand::HandDynamics;
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Collider, Model, Owner};
use crate::state::Sleep;
use palmares_models::{Pose, Vec3};

/// Whether two shapes belong to links.
#[inline]
pub(super) fn within_hand(a: &Collider, b: &Collider) -> bool {
    matches!((a.owner, b.owner), (Owner::Link(_), Owner::Link(_)))
}

/// Part of the way from rest below which the way of the present speeds hardly matters.
const SLOW: f64 = 0.1;

/// The bodies of a world and how they move.
pub struct Bodies<'a> {
    /// Model of the world.
    pub(crate) model: &'a Model,
    /// Dynamics of the hand.
    pub(crate) dynamics: &'a HandDynamics,
    /// Generalized velocity.
    pub(crate) v: &'a [f64],
    /// Central poses of the objects.
    pub(crate) objects: &'a [Pose],
    /// Sleep state of the objects.
    pub(crate) sleep: &'a [Sleep],
}

impl Bodies<'_> {
    /// Spatial velocity of a body about a point of the world.
    #[inline(always)]
    pub fn velocity(&self, owner: Owner, at: Vec3) -> SpatialVelocity {
        match owner {
            Owner::Static => SpatialVelocity::ZERO,
            Owner::Link(i) => self.dynamics.recursion.velocity[i].moved(at - self.dynamics.kin.origin),
            Owner::Object(k) => {
                let v = &self.v[self.model.object_dofs(k)..];
                let motion = SpatialVelocity {
                    linear: Vec3::new(v[0], v[1], v[2]),
                    angular: Vec3::new(v[3], v[4], v[5]),
                };
                motion.moved(at - self.objects[k].translation)
            }
        }
    }

    /// The reach of two shapes by their relative speed, if it is less than their `speeds` together, m/s, and these matter.
    #[inline(always)]
    pub(super) fn reach(
        &self,
        (i, a): (usize, &Collider),
        (j, b): (usize, &Collider),
        poses: &[Pose],
        speeds: f64,
    ) -> Reach {
        let config = self.model.config();
        let widest = Reach::new(config, within_hand(a, b), speeds);
        if widest.approach < SLOW * widest.from_rest {
            return widest;
        }
        let (bounded, radius) = bounded((i, a), (j, b));
        let at = poses[bounded].translation;
        let relative = self.velocity(b.owner, at) - self.velocity(a.owner, at);
        let fastest = relative.linear.length() + relative.angular.length() * radius;
        Reach::new(config, within_hand(a, b), fastest.min(speeds))
    }

    /// Whether a body may move in this step.
    #[inline]
    pub fn is_awake(&self, owner: Owner) -> bool {
        match owner {
            Owner::Static => false,
            Owner::Link(_) => true,
            Owner::Object(k) => !self.sleep[k].asleep,
        }
    }

    /// Whether a body takes part in a step without being woken.
    #[inline]
    pub(super) fn takes_part(&self, owner: Owner) -> bool {
        owner == Owner::Static || self.is_awake(owner)
    }
}

/// The shape of two that has bounds, and its radius, m.
#[inline]
pub(super) fn bounded((i, a): (usize, &Collider), (j, b): (usize, &Collider)) -> (usize, f64) {
    if b.bounding_radius.is_finite() { (j, b.bounding_radius) } else { (i, a.bounding_radius) }
}
