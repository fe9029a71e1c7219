//! How the shapes move from step to step, in the world and as seen from the hand's base.
//!
//! A gap is the same in every frame. Between two poses of two shapes it changes by no more than the ways of their points, and these
//! are shortest in the frame in which the shapes move least: a held object and the fingers around it hardly move as seen from the
//! base, however the hand is carried. So a pair of the hand counts its ways there, and every other pair in the world.
//!
//! A point at r of a shape that goes from a pose (x₀, R₀) to (x₁, R₁) moves by `|x₁ − x₀ + (R₁ − R₀) r|`, at most
//! `|x₁ − x₀| + 2 sin(θ/2) |r|` with the angle θ of the turn: a chord. The unit quaternions q₀, q₁ of the poses, in the same
//! hemisphere, give `2 sin(θ/2) ≤ 4 sin(θ/4) = 2 |q₁ − q₀|`. And `a + b ≤ √(2 (a² + b²))`, with one root.
//!
//! As seen from a base that goes from B₀ to B₁, a shape goes from `B₁ B₀⁻¹` times its old pose, where the base would have carried it,
//! to its new one. The bound holds whatever lies between the two poses: it is no estimate from velocities, so that a base that turns
//! needs no term of second order.

use super::bodies::Bodies;
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
    step_s: f64,
    /// Twice the way of a fall from rest in a step, m.
    fall: f64,
    /// Whether there is a base.
    by_base: bool,
    /// Pose of the base at the start of the step.
    base: Pose,
    frame: Frame,
}

/// Speed of a base, m/s and rad/s, below which bounds in the world's frame, with its motion added, are good enough in its own.
const SLOW: [f64; 2] = [0.01, 0.05];

/// The frame of the base. Speeds follow from the state alone, since the reach of a step does; ways do not.
#[derive(Clone, Copy, Debug, Default)]
struct Frame {
    /// Way and turn of the base in the last step, m and rad.
    ways: [f64; 2],
    /// Its speeds, m/s and rad/s.
    speeds: [f64; 2],
    /// What carries a shape along with it, from the last pose to the present one, unless it hardly moved.
    carry: Option<Pose>,
    /// Its velocity, unless it hardly moves.
    velocity: Option<SpatialVelocity>,
}

/// Upper bound of the way of any point of a shape of this radius, m, from one pose to another.
#[inline]
pub(super) fn way(from: &Pose, to: &Pose, radius: f64) -> f64 {
    let (p, q) = (from.rotation, to.rotation);
    let turn = (q - p).length_squared().min((q + p).length_squared());
    let squared = from.translation.distance_squared(to.translation) + 4.0 * turn * radius * radius;
    // The factor covers rounding.
    1.000_001 * (2.0 * squared).sqrt()
}

/// Upper bound of the speed of any point of a shape with this velocity about its origin, m/s.
#[inline]
pub(super) fn speed(motion: SpatialVelocity, shape: &Collider) -> f64 {
    motion.linear.length() + motion.angular.length() * shape.bounding_radius
}

impl Motion {
    /// Prepares for `shapes` and the base of a hand, if there is one.
    pub(super) fn begin(&mut self, shapes: usize, bodies: &Bodies<'_>) {
        let hand = bodies.model.hand().is_some();
        let count = if hand { 2 * shapes } else { shapes };
        self.by_base = hand;
        let config = bodies.model.config();
        self.step_s = config.step_s;
        self.fall = config.gravity.length() * config.step_s * config.step_s;
        self.speeds.resize(count, 0.0);
        self.ways.resize(count, 0.0);
        if hand {
            let dynamics = bodies.dynamics;
            let (before, now) = (self.base, dynamics.kin.pose[0]);
            self.base = now;
            let velocity = dynamics.recursion.velocity[0];
            let speeds = [velocity.linear.length(), velocity.angular.length()];
            let h = self.step_s;
            let ways = [
                way(&before, &Pose { rotation: before.rotation, ..now }, 0.0),
                way(&Pose::from_parts(now.translation, before.rotation), &now, 1.0),
            ];
            let slow_way = (0..2).all(|k| ways[k] <= h * SLOW[k]);
            let slow = (0..2).all(|k| speeds[k] <= SLOW[k]);
            self.frame = Frame {
                ways,
                speeds,
                carry: (!slow_way).then(|| now * before.inverse()),
                velocity: (!slow).then_some(velocity),
            };
        }
    }

    /// A body's shape rests in the world.
    #[inline(always)]
    pub(super) fn rests(&mut self, (i, shape): (usize, &Collider), at: &Pose) {
        (self.ways[i], self.speeds[i]) = (0.0, 0.0);
        if let Some(slot) = self.slot_by_base(i) {
            let far = self.far(shape, at);
            (self.ways[slot], self.speeds[slot]) = (self.way_added(0.0, far), self.speed_added(0.0, far));
        }
    }

    /// A body's shape moves from one pose in the world to another. No point of it moved faster than the faster of its two speeds,
    /// apart from gravity on a ballistic path and rounding.
    #[inline(always)]
    pub(super) fn moves(
        &mut self,
        bodies: &Bodies<'_>,
        (i, shape): (usize, &Collider),
        from: &Pose,
        to: &Pose,
    ) {
        let before = self.speeds[i];
        let velocity = bodies.velocity(shape.owner, to.translation);
        let now = speed(velocity, shape);
        let faster = now.max(before);
        let own = if faster > 0.0 { 1.01 * self.step_s * faster + self.fall } else { 0.0 };
        // The step of a hand starts with a third of its last displacement (BDF2).
        let linked = matches!(shape.owner, Owner::Link(_));
        self.ways[i] = if linked { own.max((self.ways[i] + 2.0 * own) / 3.0) } else { own };
        self.speeds[i] = now;
        let Some(slot) = self.slot_by_base(i) else { return };
        let far = self.far(shape, to);
        self.ways[slot] = match &self.frame.carry {
            Some(carry) => way(&(*carry * *from), to, shape.bounding_radius),
            None => self.way_added(self.ways[i], far),
        };
        self.speeds[slot] = match &self.frame.velocity {
            Some(base) => speed(velocity - base.moved(to.translation - bodies.dynamics.kin.origin), shape),
            None => self.speed_added(now, far),
        };
    }

    /// Where a shape counts as seen from the base, if there is one.
    #[inline(always)]
    fn slot_by_base(&self, i: usize) -> Option<usize> {
        self.by_base.then_some(self.speeds.len() / 2 + i)
    }

    /// Bound of the distance of a shape's points from the base, m.
    #[inline(always)]
    fn far(&self, shape: &Collider, at: &Pose) -> f64 {
        (at.translation - self.base.translation).abs().element_sum() + shape.bounding_radius
    }

    /// Way as seen from the base, m, of a point with this way in the world. The turn carries the point from where it was: farther off
    /// by no more than what both have moved.
    #[inline(always)]
    fn way_added(&self, own: f64, far: f64) -> f64 {
        let [linear, turn] = self.frame.ways;
        own + linear + turn * (far + own + linear)
    }

    /// Speed as seen from the base, m/s, of a point with this speed in the world.
    #[inline(always)]
    fn speed_added(&self, own: f64, far: f64) -> f64 {
        let [linear, angular] = self.frame.speeds;
        own + linear + angular * far
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::{Rotation, Vec3};

    /// The bound holds for the point that moves farthest, and is at most √2 times its way and arc.
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
            assert!(moved <= bound && bound <= 1.415 * (0.02 + 0.1 * turn), "{turn}: {moved} {bound}");
            // The two quaternions of a rotation are one rotation.
            let other = Pose::from_parts(to.translation, -to.rotation);
            assert_eq!(way(&from, &other, 0.1), bound);
        }
    }
}
