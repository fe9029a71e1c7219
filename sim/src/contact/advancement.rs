//! Conservative advancement (Mirtich 1996): how far two convex shapes can go on their ways through a step before they overlap by
//! more than they may.
//!
//! Along a direction n of the world the overlap of two shapes grows no faster than
//!
//! `−n·(w_b − w_a) + |n × θ_a| r_a + |n × θ_b| r_b`
//!
//! with their ways w, m, and their turns θ, rad, over the step, each about an axis through the body's centre, from which no point
//! of the shape's core is farther than r, m. What is apart along n, less what overlap is allowed, over this rate is a part of the
//! step in which nothing can happen. Then the direction is found anew.

use super::narrow_phase::apart;
use crate::bounds::MANIFOLD_WORK;
use crate::model::Collider;
use palmares_models::{Pose, Rotation, Vec3};

/// So often the direction of a pair is found anew at most; then it stops where it has come to.
const MOST: usize = 128;

/// Shapes that could come to overlap by more than they may stop at this part of it, ...
const STOP: f64 = 0.5;

/// ... and go on at least by this part of it at a time.
const NEAR: f64 = 1.0 / 32.0;

/// The motion of a body in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sweep {
    /// Where it starts.
    pub start: Pose,
    /// Way of its centre, m.
    pub way: Vec3,
    /// Its turn about an axis of the world through its centre, rad.
    pub turn: Vec3,
}

impl Sweep {
    /// From one pose to another. Of all turns that lead there it is the one nearest to `about`, rad.
    pub fn between(start: Pose, end: Pose, about: Vec3) -> Self {
        let turn = end.rotation * start.rotation.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let across = Vec3::new(turn.x, turn.y, turn.z);
        let sine = across.length();
        let Some(axis) = across.try_normalize() else {
            return Sweep { start, way: end.translation - start.translation, turn: Vec3::ZERO };
        };
        let angle = 2.0 * libm::atan2(sine, turn.w);
        let whole = libm::rint((about.dot(axis) - angle) / std::f64::consts::TAU);
        let turn = axis * (angle + whole * std::f64::consts::TAU);
        Sweep { start, way: end.translation - start.translation, turn }
    }

    /// Where the body is after a part of the step.
    pub fn at(&self, part: f64) -> Pose {
        Pose::from_parts(
            self.start.translation + self.way * part,
            (Rotation::from_scaled_axis(self.turn * part) * self.start.rotation).normalize(),
        )
    }

    /// Ends it after a part of it.
    pub fn shorten(&mut self, part: f64) {
        self.way *= part;
        self.turn *= part;
    }

    /// How far a point of a shape on the body goes at most, m.
    pub fn longest_way(&self, shape: &Collider) -> f64 {
        self.way.length() + self.turn.length() * radius_about(self, shape)
    }
}

/// How far a shape's core reaches from the axis that its body turns about, m.
fn radius_about(sweep: &Sweep, shape: &Collider) -> f64 {
    let Some(axis) = sweep.turn.try_normalize() else { return 0.0 };
    let axis = shape.body_from_shape.rotation.inverse() * (sweep.start.rotation.inverse() * axis);
    let round = if shape.is_ball { shape.bounding_radius } else { shape.rounding };
    let center = shape.body_from_shape.inverse_transform_point(Vec3::ZERO);
    let middle = shape.local_bounds.center() - center;
    let half = shape.local_bounds.half_extents() - Vec3::splat(round);
    let mut most: f64 = 0.0;
    for [x, y] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
        for z in [1.0, -1.0] {
            most = most.max((middle + half * Vec3::new(x, y, z)).cross(axis).length_squared());
        }
    }
    most.sqrt()
}

/// A shape and the motion of its body.
#[derive(Clone, Copy)]
pub struct Moving<'a> {
    /// The shape.
    pub shape: &'a Collider,
    /// Its body's motion.
    pub sweep: &'a Sweep,
}

impl Moving<'_> {
    /// Where the shape is after a part of the step.
    fn at(&self, part: f64) -> Pose {
        self.sweep.at(part) * self.shape.body_from_shape
    }
}

/// How fast two shapes can come to overlap along directions of the world.
struct Rate {
    way: Vec3,
    turns: [(Vec3, f64); 2],
}

impl Rate {
    fn of(a: Moving<'_>, b: Moving<'_>) -> Self {
        let turn = |of: Moving<'_>| (of.sweep.turn, radius_about(of.sweep, of.shape));
        Rate { way: b.sweep.way - a.sweep.way, turns: [turn(a), turn(b)] }
    }

    /// Along a unit direction from A to B, m over the step.
    fn along(&self, normal: Vec3) -> f64 {
        let [a, b] = self.turns.map(|(turn, radius)| normal.cross(turn).length() * radius);
        a + b - self.way.dot(normal)
    }

    /// Along any.
    fn at_most(&self) -> f64 {
        let [a, b] = self.turns.map(|(turn, radius)| turn.length() * radius);
        a + b + self.way.length()
    }
}

/// Whether two shapes that are `apart`, m, along a unit direction of the world from A to B cannot come to overlap along it by more
/// than `most` in the step.
pub fn stays_apart(a: Moving<'_>, b: Moving<'_>, normal: Vec3, apart: f64, most: f64) -> bool {
    Rate::of(a, b).along(normal) <= apart + most
}

/// The part of the step after which two shapes stop that could come to overlap by more than `most`, m: where they overlap by half of
/// it, or nearly so; 1 if they do not. Shapes that start with a deeper overlap may deepen it by 1/32 of `most`. What it computes is
/// added to `spent`.
pub fn free_part(a: Moving<'_>, b: Moving<'_>, most: f64, spent: &mut u64) -> f64 {
    let rate = Rate::of(a, b);
    let reach = rate.at_most();
    let near = NEAR * most;
    let (mut part, mut before, mut least) = (0.0, 0.0, -STOP * most);
    let mut direction = Vec3::ZERO;
    for k in 0..MOST {
        *spent += MANIFOLD_WORK;
        let (at_a, at_b) = (a.at(part), b.at(part));
        let a_from_b = at_a.inv_mul(&at_b);
        let Some((normal, apart)) = apart(a.shape, b.shape, &a_from_b, reach, direction) else {
            return 1.0;
        };
        direction = normal;
        let rate = rate.along(at_a.rotation * normal);
        if k == 0 {
            if rate <= apart + most {
                return 1.0;
            }
            least = least.min(apart - near);
        } else if apart <= least {
            return before;
        }
        let left = apart - least;
        if rate * (1.0 - part) <= left || part >= 1.0 {
            return 1.0;
        }
        before = part;
        part = (part + left.max(near) / rate).min(1.0);
    }
    before
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::model::Model;
    use palmares_models::shape::Shape;

    /// A plate of 1 mm across x, and a rod along z.
    fn shapes() -> Vec<Collider> {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        for shape in [
            Shape::Box { half_extents: [0.5e-3, 0.3, 0.3], rounding: 0.0 },
            Shape::Capsule { radius: 1e-3, half_length: 0.03 },
        ] {
            model.add_static("shape", &shape, Pose::IDENTITY, 0.5).expect("it fits");
        }
        model.colliders().to_vec()
    }

    #[test]
    fn a_sweep_leads_to_its_end_however_far_it_turns() {
        for angle in [0.0, 1e-9, 0.3, 3.0, 4.0, 40.0, -7.0] {
            let about = Vec3::new(1.0, 2.0, -0.5).normalize() * angle;
            let start = Pose::from_parts(Vec3::X, Rotation::from_rotation_z(0.7));
            let end = Pose::from_parts(Vec3::Y, Rotation::from_scaled_axis(about) * start.rotation);
            let sweep = Sweep::between(start, end, about * 1.001);
            assert!((sweep.turn - about).length() < 1e-7, "{angle}: {}", sweep.turn);
            assert!((sweep.at(1.0).translation - Vec3::Y).length() < 1e-15);
            assert!(sweep.at(1.0).rotation.dot(end.rotation).abs() > 1.0 - 1e-14);
        }
    }

    /// A rod whose end turns through a plate stops in it, less deep than it may; one that turns beside the plate goes on.
    #[test]
    fn what_turns_stops_where_it_meets() {
        let shapes = shapes();
        let (still, most) = (Sweep::default(), 0.5e-3);
        for angle in [0.5, 1.0, 2.0, 6.0] {
            for (x, meets) in [(-0.02, true), (-0.029, true), (-0.033, false)] {
                let sweep = Sweep {
                    start: Pose::translation(x, 0.0, 0.0),
                    way: Vec3::ZERO,
                    turn: Vec3::new(0.0, angle, 0.0),
                };
                let a = Moving { shape: &shapes[0], sweep: &still };
                let b = Moving { shape: &shapes[1], sweep: &sweep };
                let mut spent = 0;
                let part = free_part(a, b, most, &mut spent);
                let reaches = meets && libm::sin(angle.min(1.57)) * 0.03 > -x;
                assert_eq!(part < 1.0, reaches, "{angle} {x}: {part}");
                assert!(spent <= MOST as u64 * MANIFOLD_WORK);
                let stops = b.at(part);
                let (_, apart) = apart(a.shape, b.shape, &stops, 1.0, Vec3::ZERO).expect("they are near");
                assert!(!reaches || apart > -STOP * most && apart < 0.0, "{angle} {x}: {apart}");
            }
        }
    }

    #[test]
    fn what_starts_too_deep_gets_hardly_deeper_and_comes_out() {
        let shapes = shapes();
        let (still, most) = (Sweep::default(), 0.5e-3);
        let part = |way: f64| {
            let start = Pose::translation(-1.1e-3, 0.0, 0.0);
            let sweep = Sweep { start, way: Vec3::X * way, turn: Vec3::ZERO };
            let (a, b) =
                (Moving { shape: &shapes[0], sweep: &still }, Moving { shape: &shapes[1], sweep: &sweep });
            free_part(a, b, most, &mut 0)
        };
        assert!(part(0.01) * 0.01 <= most / 16.0, "{}", part(0.01));
        assert_eq!(part(-0.01), 1.0);
    }
}
