//! Thirty different objects in a box, and the hand that reaches into them.

use super::case::{Case, Finding};
use super::setup::{Setup, ends_of_steps, ramp, risen, steps};
use crate::case_report::Figure;
use crate::random::Random;
use crate::recorder::Recorder;
use crate::rigs::softhand;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State, World};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "thirty_objects_and_hand",
        "30 balls, boxes and cylinders pour into a 50 cm box; SoftHand reaches in palm down, closes, lifts",
        poured,
    ),
    Case::new(
        "dense_heap_and_hand",
        "SoftHand digs, fingers first, in a settled heap of 30 mixed objects in a 28 cm box",
        dense_heap,
    ),
];

/// Inner half width and height of the dense heap's box, m.
const HALF_M: f64 = 0.14;
const HEIGHT_M: f64 = 0.25;

/// Half width of the box that objects are poured into, m: that of the 2016 scenes.
const WIDE_HALF_M: f64 = 0.25;
const WIDE_HEIGHT_M: f64 = 0.3;
/// Time, s, and step with which the pile settles before the case begins: every run of the case starts from
/// the same pile.
const SETTLE_S: f64 = 2.5;
const SETTLE_STEP_S: f64 = 1e-3;

/// Convex parts of an object that fits into a sphere of 4.5 cm radius.
type Parts = Vec<(Pose, Shape)>;

/// An object of one of six kinds, in turn.
fn parts(kind: usize, random: &mut Random) -> Parts {
    let whole = |shape| vec![(Pose::IDENTITY, shape)];
    let rounded = |half_extents| Shape::Box { half_extents, rounding: 2e-3 };
    match kind % 6 {
        0 => whole(Shape::Sphere { radius: random.between(0.018, 0.04) }),
        1 => whole(Shape::Box {
            half_extents: [
                random.between(0.012, 0.03),
                random.between(0.012, 0.03),
                random.between(0.012, 0.025),
            ],
            rounding: 0.0,
        }),
        2 => whole(Shape::Cylinder {
            radius: random.between(0.012, 0.03),
            half_length: random.between(0.015, 0.035),
        }),
        3 => whole(Shape::Capsule {
            radius: random.between(0.01, 0.02),
            half_length: random.between(0.015, 0.028),
        }),
        4 => {
            let (a, b, c) =
                (random.between(0.02, 0.035), random.between(0.02, 0.035), random.between(0.015, 0.03));
            let point = |random: &mut Random| {
                let d = random.direction();
                [a * d.x, b * d.y, c * d.z]
            };
            whole(Shape::Hull { points: (0..16).map(|_| point(random)).collect(), rounding: 2e-3 })
        }
        // A hammer: a handle and a head across it.
        _ => vec![
            (Pose::IDENTITY, Shape::Capsule { radius: 0.009, half_length: 0.025 }),
            (
                Pose::translation(0.0, 0.0, 0.028),
                rounded([random.between(0.02, 0.027), 0.012, random.between(0.009, 0.012)]),
            ),
        ],
    }
}

/// Walls of a box on a wide floor whose top is z = 0, all of them thick.
pub(super) fn add_box(model: &mut Model, (w, height): (f64, f64)) -> Result<()> {
    let t = 0.01;
    let h = 0.5 * height;
    let slabs = [
        ([0.0, 0.0, -5.0 * t], [2.0, 2.0, 5.0 * t]),
        ([w + t, 0.0, h], [t, w + 2.0 * t, h]),
        ([-w - t, 0.0, h], [t, w + 2.0 * t, h]),
        ([0.0, w + t, h], [w, t, h]),
        ([0.0, -w - t, h], [w, t, h]),
    ];
    for (at, half_extents) in slabs {
        let shape = Shape::Box { half_extents, rounding: 0.0 };
        model.add_static("box", &shape, Pose::from_translation(Vec3::from_array(at)), 0.5)?;
    }
    Ok(())
}

/// `count` random objects and their poses after they settled in our own world.
fn settled(count: usize, seed: u64) -> Result<(Vec<Arc<Object>>, Vec<Pose>)> {
    let mut random = Random::new(seed);
    let mut model = Model::new(Config::with_step(SETTLE_STEP_S), None)?;
    add_box(&mut model, (HALF_M, HEIGHT_M))?;
    let (mut objects, mut poses) = (Vec::new(), Vec::new());
    for k in 0..count {
        let mass = random.magnitude(0.05, 1.0);
        let object = Arc::new(
            Object::new(format!("object_{k}"), parts(k, &mut random), mass, 0.6, 5e-4)?
                .with_torsional_friction(5e-4)?,
        );
        // Layers of nine that cannot touch one another.
        let (column, row, layer) = (k % 3, k / 3 % 3, k / 9);
        let at = Vec3::new(column as f64 - 1.0, row as f64 - 1.0, layer as f64 + 0.55) * 0.092;
        let place = Pose::from_parts(at + random.cube() * 1e-3, random.rotation());
        model.add_object(Arc::clone(&object))?;
        objects.push(object);
        poses.push(place);
    }
    let state = State::at_rest(&model, Pose::IDENTITY, &poses);
    let mut world = World::new(Arc::new(model), state);
    let nothing = Command::stay(world.model(), Pose::IDENTITY);
    for _ in 0..steps(SETTLE_S, SETTLE_STEP_S) {
        world.step(&nothing);
    }
    let rest = (0..count).map(|k| world.state().object_pose(world.model(), k)).collect();
    Ok((objects, rest))
}

/// The hand comes down into the pile, closes and rises, over 4.5 s. The figure is the largest distance of an
/// object's centre beyond the box's inner planes: nothing may pass through a wall or the floor. An object
/// that the hand has carried above the rim may fall anywhere but through the floor.
pub fn dense_heap(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (objects, poses) = settled(30, 30)?;
    let mut model = Model::new(Config::with_step(setup.dt_s), Some(softhand()?))?;
    add_box(&mut model, (HALF_M, HEIGHT_M))?;
    for object in objects {
        model.add_object(object)?;
    }
    // Fingers down, palm towards -x.
    let down = Rotation::from_rotation_y(std::f64::consts::PI);
    let top = Pose::from_parts(Vec3::new(0.03, -0.03, 0.5), down);
    let state = State::at_rest(&model, top, &poses);
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), top);
    let mut escape = Escape::new(poses.len(), (HALF_M, HEIGHT_M));
    for t in ends_of_steps(4.5, setup.dt_s) {
        let (sink, sinking) = ramp(t / 1.5);
        let (rise, rising) = ramp((t - 2.7) / 1.3);
        let depth = 0.24;
        command.sigma[0] = ramp((t - 1.6) / 0.8).0;
        command.base = risen(top, depth * (rise - sink), depth * (rising / 1.3 - sinking / 1.5));
        recorder.step(&mut *world, &command)?;
        escape.look(&world.state().objects);
    }
    Ok(recorder.finding(escape.figure()))
}

/// Balls, boxes and cylinders of half a ton per cubic metre fall in layers of nine into the box while the hand waits
/// above; from 1 s on it comes down palm first, closes at 2 s and rises at 3 s. The figure is that of the dense heap.
pub fn poured(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut random = Random::new(2016);
    let mut model = Model::new(Config::with_step(setup.dt_s), Some(softhand()?))?;
    add_box(&mut model, (WIDE_HALF_M, WIDE_HEIGHT_M))?;
    let mut poses = Vec::new();
    for k in 0..30 {
        let r = random.between(0.03, 0.05);
        let (shape, volume) = match k % 3 {
            0 => (Shape::Sphere { radius: r }, 4.0 / 3.0 * PI * r.powi(3)),
            1 => {
                let half_extents = [r, 0.8 * r, 0.7 * r];
                (Shape::Box { half_extents, rounding: 0.0 }, 8.0 * 0.56 * r.powi(3))
            }
            _ => (Shape::Cylinder { radius: 0.8 * r, half_length: 0.8 * r }, 2.0 * PI * (0.8 * r).powi(3)),
        };
        let parts = vec![(Pose::IDENTITY, shape)];
        model.add_object(Arc::new(
            Object::new(format!("object_{k}"), parts, 500.0 * volume, 0.6, 5e-4)?
                .with_torsional_friction(5e-4)?,
        ))?;
        let (column, row, layer) = (k % 9 % 3, k % 9 / 3, k / 9);
        let grid = Vec3::new(column as f64 - 1.0, row as f64 - 1.0, layer as f64);
        let at = grid * 0.12 + Vec3::new(0.0, 0.0, 0.07) + random.cube() * 0.01;
        poses.push(Pose::from_parts(at, random.rotation()));
    }
    let palm_down = Rotation::from_rotation_y(FRAC_PI_2);
    // Next to the layers that are still to fall.
    let top = Pose::from_parts(Vec3::new(-0.17, 0.0, 0.6), palm_down);
    let state = State::at_rest(&model, top, &poses);
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), top);
    let mut escape = Escape::new(poses.len(), (WIDE_HALF_M, WIDE_HEIGHT_M));
    for t in ends_of_steps(5.0, setup.dt_s) {
        let (sink, sinking) = ramp(t - 1.0);
        let (rise, rising) = ramp(t - 3.0);
        let depth = 0.43;
        command.sigma[0] = ramp((t - 2.0) / 0.7).0;
        command.base = risen(top, depth * (rise - sink), depth * (rising - sinking));
        recorder.step(&mut *world, &command)?;
        escape.look(&world.state().objects);
    }
    Ok(recorder.finding(escape.figure()))
}

/// Largest distance of an object's centre beyond a box. An object that was above the rim once may fall
/// anywhere but through the floor.
pub(super) struct Escape {
    half_m: f64,
    height_m: f64,
    over_the_rim: Vec<bool>,
    farthest_m: f64,
}

impl Escape {
    pub(super) fn new(count: usize, (half_m, height_m): (f64, f64)) -> Self {
        Escape { half_m, height_m, over_the_rim: vec![false; count], farthest_m: 0.0 }
    }

    pub(super) fn look(&mut self, poses: &[Pose]) {
        for (pose, over) in poses.iter().zip(&mut self.over_the_rim) {
            let p = pose.translation;
            *over |= p.z > self.height_m;
            if !*over {
                self.farthest_m = self.farthest_m.max(p.x.abs() - self.half_m).max(p.y.abs() - self.half_m);
            }
            self.farthest_m = self.farthest_m.max(-p.z);
        }
    }

    pub(super) fn figure(&self) -> Figure {
        Figure::bounded("farthest object centre beyond a wall", self.farthest_m.max(0.0) * 1e3, "mm", 0.0)
    }
}
