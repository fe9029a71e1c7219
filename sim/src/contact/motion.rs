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
//! to its new one; if the base hardly turns, from its old pose shifted with the base, and the turn is added. The bound holds whatever lies between the two poses: it is no estimate from velocities, so that a base that turns
//! needs no term of second order.

use super::bodies::Bodies;
use crate::config::Config;
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::Collider;
use palmares_models::{Pose, Vec3};

/// Ways and speeds of all shapes; first in the world and then, if there is a hand, in the frame of its base.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    /// Upper bound of the speed of any point of each shape at the start of the step, m/s.
    pub speeds: Vec<f64>,
    /// Largest distance that any point of each shape has moved in the last step, m.
    pub ways: Vec<f64>,
    /// The speed in the world, now.
    pub(super) now: Vec<f64>,
    /// Upper bound of the distance of any point of each shape from the base, m.
    pub(super) far: Vec<f64>,
    /// Way and speed as seen from a base that moves fast, m and m/s.
    pub(super) seen: Vec<[f64; 2]>,
    /// Number of shapes of the hand, which come first.
    linked: usize,
    pub(super) frame: Frame,
}

/// Speed of a base, m/s and rad/s, below which bounds in the world's frame, with its motion added, are good enough in its own.
const SLOW: [f64; 2] = [0.01, 0.05];

/// What carries a shape along with the base, from the last pose to the present one.
#[derive(Clone, Copy, Debug, Default)]
enum Carry {
    /// The base hardly moved.
    #[default]
    Nothing,
    /// It hardly turned.
    Along(Vec3),
    With(Pose),
}

/// The frame of the base. Speeds follow from the state alone, since the reach of a step does; ways do not.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Frame {
    /// Whether there is a base.
    pub by_base: bool,
    /// Pose of the base at the start of the step.
    base: Pose,
    /// Way and turn of the base in the last step, m and rad.
    ways: [f64; 2],
    /// Its speeds, m/s and rad/s.
    speeds: [f64; 2],
    carry: Carry,
    /// Its velocity, unless it hardly moves.
    velocity: Option<SpatialVelocity>,
}

/// Upper bound of the way of any point of a shape of this radius, m, from one pose to another.
#[inline]
pub(super) fn way(from: &Pose, to: &Pose, radius: f64) -> f64 {
    let (p, q) = (from.rotation, to.rotation);
    let turn = (q - p).length_squared();
    // The other quaternion of the same rotation is nearer: the sum of both squares is 4.
    let turn = if turn > 2.0 { (q + p).length_squared() } else { turn };
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
    /// Prepares for the shapes of a model and the base of its hand, if it has one; `fresh` if nothing is known of them.
    pub(super) fn begin(&mut self, bodies: &Bodies<'_>, fresh: bool) {
        let hand = bodies.model.hand().is_some();
        if fresh {
            let shapes = bodies.model.colliders().len();
            let count = if hand { 2 * shapes } else { shapes };
            self.speeds.resize(count, 0.0);
            self.ways.resize(count, 0.0);
            self.now.resize(shapes, 0.0);
            self.far.resize(shapes, 0.0);
            self.seen.resize(shapes, [0.0; 2]);
            self.linked = bodies.model.hand_colliders();
        }
        if hand {
            self.frame.move_on(bodies);
        }
    }

    /// Finds the ways and speeds.
    pub(super) fn end(&mut self, bodies: &Bodies<'_>) {
        let config = bodies.model.config();
        let (shapes, linked) = (self.now.len(), self.linked);
        let (ways, ways_by_base) = self.ways.split_at_mut(shapes);
        let (speeds, speeds_by_base) = self.speeds.split_at_mut(shapes);
        travelled::<true>(config, &mut ways[..linked], &speeds[..linked], &self.now[..linked]);
        travelled::<false>(config, &mut ways[linked..], &speeds[linked..], &self.now[linked..]);
        speeds.copy_from_slice(&self.now);
        if !self.frame.by_base {
            return;
        }
        let [linear, turn] = self.frame.ways;
        // The turn carries a point from where it was: farther off by no more than what both have moved.
        let turned = |own: f64, far: f64| own + turn * (far + own);
        if matches!(self.frame.carry, Carry::Nothing) {
            for ((by_base, way), far) in ways_by_base.iter_mut().zip(&*ways).zip(&self.far) {
                *by_base = turned(way + linear, *far);
            }
        } else {
            for ((by_base, [way, _]), far) in ways_by_base.iter_mut().zip(&self.seen).zip(&self.far) {
                *by_base = turned(*way, *far);
            }
        }
        let [linear, angular] = self.frame.speeds;
        if self.frame.velocity.is_none() {
            for ((by_base, speed), far) in speeds_by_base.iter_mut().zip(&*speeds).zip(&self.far) {
                *by_base = speed + linear + angular * far;
            }
        } else {
            speeds_by_base.iter_mut().zip(&self.seen).for_each(|(by_base, [_, speed])| *by_base = *speed);
        }
    }
}

/// Ways in the last step, from the speeds before and now. No point of a shape moved faster than the faster of them, apart from
/// gravity on a ballistic path and rounding.
#[inline]
fn travelled<const LINKED: bool>(config: &Config, ways: &mut [f64], before: &[f64], now: &[f64]) {
    let h = config.step_s;
    // Twice the way of a fall from rest in a step.
    let fall = config.gravity.length() * h * h;
    for ((way, before), now) in ways.iter_mut().zip(before).zip(now) {
        let faster = if now > before { now } else { before };
        let own = if *faster > 0.0 { 1.01 * h * faster + fall } else { 0.0 };
        // The step of a hand starts with a third of its last displacement (BDF2).
        let more = (1.0 / 3.0) * *way + (2.0 / 3.0) * own;
        *way = if LINKED && more > own { more } else { own };
    }
}

impl Frame {
    /// Moves on to the present pose of the base.
    fn move_on(&mut self, bodies: &Bodies<'_>) {
        let (before, now) = (self.base, bodies.dynamics.kin.pose[0]);
        let velocity = bodies.dynamics.recursion.velocity[0];
        let speeds = [velocity.linear.length(), velocity.angular.length()];
        let h = bodies.model.config().step_s;
        let along = now.translation - before.translation;
        let turned = Pose { translation: now.translation, ..before };
        let mut ways = [1.000_001 * along.length(), way(&turned, &now, 1.0)];
        let slow = (0..2).all(|k| speeds[k] <= SLOW[k]);
        let carry = match [0, 1].map(|k| ways[k] <= h * SLOW[k]) {
            [true, true] => Carry::Nothing,
            [false, true] => Carry::Along(along),
            // What it carries along needs no turn added.
            [_, false] => {
                ways = [0.0; 2];
                Carry::With(now * before.inverse())
            }
        };
        *self =
            Frame { by_base: true, base: now, ways, speeds, carry, velocity: (!slow).then_some(velocity) };
    }

    /// Way and speed of a body's shape that rests in the world, as seen from the base.
    pub(super) fn rests(&self, shape: &Collider, at: &Pose, far: f64) -> [f64; 2] {
        let [linear, angular] = self.speeds;
        let way = match &self.carry {
            Carry::Nothing => 0.0,
            Carry::Along(by) => by.length(),
            Carry::With(by) => way(&(*by * *at), at, shape.bounding_radius),
        };
        [way, linear + angular * far]
    }

    /// The same for one with this velocity about its origin, which moves from one pose in the world to another; 0 for what follows
    /// from its motion in the world.
    #[inline(always)]
    pub(super) fn moves(
        &self,
        bodies: &Bodies<'_>,
        shape: &Collider,
        velocity: SpatialVelocity,
        from: &Pose,
        to: &Pose,
    ) -> [f64; 2] {
        let way = match &self.carry {
            Carry::Nothing => 0.0,
            Carry::Along(by) => {
                way(&Pose { translation: from.translation + *by, ..*from }, to, shape.bounding_radius)
            }
            Carry::With(by) => way(&(*by * *from), to, shape.bounding_radius),
        };
        let speed = self.velocity.map_or(0.0, |base| {
            speed(velocity - base.moved(to.translation - bodies.dynamics.kin.origin), shape)
        });
        [way, speed]
    }

    /// Bound of the distance of a shape's points from the base, m.
    #[inline(always)]
    pub(super) fn far(&self, shape: &Collider, at: &Pose) -> f64 {
        (at.translation - self.base.translation).abs().element_sum() + shape.bounding_radius
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
