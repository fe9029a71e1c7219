//! Conservative advancement (Mirtich 1996): the part of a step up to which two convex shapes move before
//! their overlap exceeds a limit.
//!
//! Along a direction n of the world the overlap of two shapes grows no faster than
//!
//! `−n·(w_b − w_a) + |n × θ_a| r_a + |n × θ_b| r_b`
//!
//! with their translations w, m, and their turns θ, rad, over the step. Each turn is about an axis through
//! the body's centre, and no point of the shape's core is farther than r, m, from that axis. The separation
//! along n plus the allowed overlap, divided by this rate, is a part of the step in which the limit cannot be
//! exceeded. Then the direction is computed again.

use super::pair_points::separating_axis;
use crate::bounds::MANIFOLD_WORK;
use crate::model::Collider;
use palmares_models::{Pose, Rotation, Vec3};

/// Largest number of directions computed for a pair; then the search stops at the part it has reached.
const MAX_DIRECTIONS: usize = 128;

/// Largest number of directions after which two shapes that may only pass each other count as meeting.
const DIRECTIONS_TO_PASS: usize = 16;

/// Shapes whose overlap could exceed the limit stop at this part of it.
const STOP_AT: f64 = 0.5;

/// Each advance covers at least this part of the limit.
const MIN_ADVANCE: f64 = 1.0 / 32.0;

/// The motion of a body in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sweep {
    /// Pose at the start.
    pub start: Pose,
    /// Translation of its centre, m.
    pub way: Vec3,
    /// Its turn about an axis of the world through its centre, rad.
    pub turn: Vec3,
}

impl Sweep {
    /// The motion from one pose to another. Several turns may lead there; it takes the one nearest to `about`, rad.
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

    /// Pose of the body after a part of the step.
    pub fn at(&self, part: f64) -> Pose {
        Pose::from_parts(
            self.start.translation + self.way * part,
            (Rotation::from_scaled_axis(self.turn * part) * self.start.rotation).normalize(),
        )
    }

    /// Ends the motion after a part of it.
    pub fn shorten(&mut self, part: f64) {
        self.way *= part;
        self.turn *= part;
    }

    /// Largest distance that a point of a shape on the body travels, m.
    pub fn longest_way(&self, shape: &Collider) -> f64 {
        self.way.length() + self.turn.length() * radius_about(self, shape)
    }
}

/// Distance of the farthest point of a shape's core from the body's axis of rotation, m.
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
    /// Pose of the shape after a part of the step.
    fn at(&self, part: f64) -> Pose {
        self.sweep.at(part) * self.shape.body_from_shape
    }
}

/// Largest rates at which the overlap of two shapes grows along directions of the world.
struct Rate {
    way: Vec3,
    turns: [(Vec3, f64); 2],
}

impl Rate {
    fn of(a: Moving<'_>, b: Moving<'_>) -> Self {
        let turn = |of: Moving<'_>| (of.sweep.turn, radius_about(of.sweep, of.shape));
        Rate { way: b.sweep.way - a.sweep.way, turns: [turn(a), turn(b)] }
    }

    /// Rate along a unit direction from A to B, m over the step.
    fn along(&self, normal: Vec3) -> f64 {
        let [a, b] = self.turns.map(|(turn, radius)| normal.cross(turn).length() * radius);
        a + b - self.way.dot(normal)
    }

    /// Bound for every direction.
    fn at_most(&self) -> f64 {
        let [a, b] = self.turns.map(|(turn, radius)| turn.length() * radius);
        a + b + self.way.length()
    }
}

/// Whether the overlap of two shapes cannot exceed `most`, m, in the step along the unit direction `normal` of the
/// world from A to B. `separation`, m, is theirs along it at the start.
pub fn stays_separated(a: Moving<'_>, b: Moving<'_>, normal: Vec3, separation: f64, most: f64) -> bool {
    Rate::of(a, b).along(normal) <= separation + most
}

/// Whether two shapes overlap by more than `most`, m, at some time of the step, or pass so near that it takes long to tell. The computing is added to `spent`.
pub fn meet(a: Moving<'_>, b: Moving<'_>, most: f64, spent: &mut u64) -> bool {
    // Most overlap at the end, or are apart along a direction that has parted them all the time: to advance takes many directions.
    *spent += MANIFOLD_WORK;
    let rate = Rate::of(a, b);
    let (at_a, at_b) = (a.at(1.0), b.at(1.0));
    let a_from_b = at_a.inv_mul(&at_b);
    let Some((normal, separation)) = separating_axis(a.shape, b.shape, &a_from_b, rate.at_most(), Vec3::ZERO)
    else {
        return false;
    };
    // Backwards in time the overlap grows along −n as it does forwards along n.
    separation < -most
        || rate.along(-(at_a.rotation * normal)) > separation + most
            && advance(a, b, most, DIRECTIONS_TO_PASS, spent) < 1.0
}

/// The part of the step after which two shapes stop, because their overlap could exceed `most`, m; 1 if it could
/// not. They stop where they overlap by about half of `most`. Shapes that start with a deeper overlap may deepen
/// it by 1/32 of `most`. The computing is added to `spent`.
pub fn free_part(a: Moving<'_>, b: Moving<'_>, most: f64, spent: &mut u64) -> f64 {
    advance(a, b, most, MAX_DIRECTIONS, spent)
}

/// The same with at most so many directions.
fn advance(a: Moving<'_>, b: Moving<'_>, most: f64, directions: usize, spent: &mut u64) -> f64 {
    let rate = Rate::of(a, b);
    let reach = rate.at_most();
    let near = MIN_ADVANCE * most;
    let (mut part, mut before, mut least) = (0.0, 0.0, -STOP_AT * most);
    let mut direction = Vec3::ZERO;
    for k in 0..directions {
        *spent += MANIFOLD_WORK;
        let (at_a, at_b) = (a.at(part), b.at(part));
        let a_from_b = at_a.inv_mul(&at_b);
        let Some((normal, separation)) = separating_axis(a.shape, b.shape, &a_from_b, reach, direction)
        else {
            return 1.0;
        };
        direction = normal;
        let rate = rate.along(at_a.rotation * normal);
        if k == 0 {
            if rate <= separation + most {
                return 1.0;
            }
            least = least.min(separation - near);
        } else if separation <= least {
            return before;
        }
        let left = separation - least;
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

    /// A rod whose end turns through a plate stops in it, less deep than the limit; one that turns next to
    /// the plate continues.
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
                assert!(spent <= MAX_DIRECTIONS as u64 * MANIFOLD_WORK);
                let stops = b.at(part);
                let (_, separation) =
                    separating_axis(a.shape, b.shape, &stops, 1.0, Vec3::ZERO).expect("they are near");
                assert!(
                    !reaches || separation > -STOP_AT * most && separation < 0.0,
                    "{angle} {x}: {separation}"
                );
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
