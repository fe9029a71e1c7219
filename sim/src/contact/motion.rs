//! How the shapes move from step to step, in the world and as seen from the hand's base.
//!
//! A gap is the same in every frame. Between two poses of two shapes it changes by no more than the ways of their points, and these
//! are shortest in the frame in which the shapes move least: a held object and the fingers around it hardly move as seen from the
//! base, however the hand is carried. So a pair of the hand counts its ways there, and every other pair in the world.
//!
//! A point at r of a shape that goes from a pose (x₀, R₀) to (x₁, R₁) moves by `|x₁ − x₀ + (R₁ − R₀) r|`, at most
//! `|x₁ − x₀| + 2 sin(θ/2) |r|` with the angle θ of the turn: a chord. The unit quaternions q₀, q₁ of the poses, in the same
//! hemisphere, give `2 sin(θ/2) ≤ 4 sin(θ/4) = 2 |q₁ − q₀|`. This holds for the relative poses in the base's frame as well, and
//! whatever lies between the two poses: it is no estimate from velocities, so that a base that turns needs no term of second order.

use super::narrow_phase::Bodies;
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Collider, Owner};
use palmares_models::Pose;

/// Ways and speeds of all shapes; first in the world and then, if there is a hand, in the frame of its base.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    /// Upper bound of the speed of any point of each shape at the start of the step, m/s.
    pub speeds: Vec<f64>,
    /// Largest distance that any point of each shape has moved in the last step, m.
    pub ways: Vec<f64>,
    /// Poses in the frame of the base.
    from_base: Vec<Pose>,
}

/// Upper bound of the way of any point of a shape of this radius, m, from one pose to another.
#[inline]
pub(super) fn way(from: &Pose, to: &Pose, radius: f64) -> f64 {
    let (p, q) = (from.rotation, to.rotation);
    let turn = (q - p).length_squared().min((q + p).length_squared()).sqrt();
    // The factor covers rounding.
    1.000_001 * (from.translation.distance(to.translation) + 2.0 * turn * radius)
}

/// Upper bound of the speed of any point of a shape with this velocity about its origin, m/s.
#[inline]
pub(super) fn speed(motion: SpatialVelocity, shape: &Collider) -> f64 {
    motion.linear.length() + motion.angular.length() * shape.bounding_radius
}

impl Motion {
    /// Prepares for `shapes`; `framed` if a hand has a frame of its own. Ways are unknown if the shapes are `fresh`.
    pub(super) fn begin(&mut self, shapes: usize, framed: bool, fresh: bool) {
        let count = if framed { 2 * shapes } else { shapes };
        self.speeds.clear();
        self.speeds.resize(count, 0.0);
        self.ways.clear();
        self.ways.resize(count, 0.0);
        if fresh {
            self.from_base.clear();
        }
        self.from_base.resize(count - shapes, Pose::IDENTITY);
    }

    /// A body's shape moves in the world from pose `from` to `to`.
    pub(super) fn moves(
        &mut self,
        bodies: &Bodies<'_>,
        (i, shape): (usize, &Collider),
        from: &Pose,
        to: &Pose,
    ) {
        self.ways[i] = way(from, to, shape.bounding_radius);
        self.speeds[i] = speed(bodies.velocity(shape.owner, to.translation), shape);
    }

    /// A body's shape is at `pose` in the world, which may move as seen from the base.
    pub(super) fn seen_from_base(
        &mut self,
        bodies: &Bodies<'_>,
        (i, shape): (usize, &Collider),
        pose: &Pose,
    ) {
        let Some(before) = self.from_base.get_mut(i) else { return };
        let (kin, at) = (&bodies.dynamics.kin, pose.translation);
        let now = kin.pose[0].inv_mul(pose);
        let slot = self.speeds.len() / 2 + i;
        self.ways[slot] = way(before, &now, shape.bounding_radius);
        *before = now;
        let relative = bodies.velocity(shape.owner, at) - bodies.velocity(Owner::Link(0), at);
        self.speeds[slot] = speed(relative, shape);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::{Rotation, Vec3};

    /// The bound holds for the point that moves farthest, and is at most the arc.
    #[test]
    fn no_point_moves_farther_than_the_bound() {
        for k in 0..200 {
            let turn = 0.015 * f64::from(k);
            let axis = Vec3::new(0.3, -0.5, 1.0).normalize();
            let from = Pose::from_parts(Vec3::new(1.0, 2.0, 3.0), Rotation::from_rotation_x(0.4));
            let by = Rotation::from_axis_angle(axis, turn);
            let to = Pose::from_parts(from.translation + axis * 0.02, by * from.rotation);
            let across = axis.any_orthonormal_vector() * 0.1;
            let moved = (to.translation - from.translation + by * across - across).length();
            let bound = way(&from, &to, 0.1);
            assert!(
                moved <= bound && bound <= 1.0001 * (0.02 + 0.1 * turn) + 1e-15,
                "{turn}: {moved} {bound}"
            );
            // The two quaternions of a rotation are one rotation.
            let other = Pose::from_parts(to.translation, -to.rotation);
            assert_eq!(way(&from, &other, 0.1), bound);
        }
    }
}
