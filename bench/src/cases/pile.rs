//! Thirty different objects in a box, and the hand that reaches into them.

use super::synergy::softhand;
use super::{Case, Finding, Setup, ramp, steps};
use crate::random::Random;
use crate::recorder::Recorder;
use crate::report::Figure;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::base::BaseCommand;
use palmares_sim::state::BaseReference;
use palmares_sim::{Command, Config, Model, State, World};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[Case {
    name: "thirty_objects_and_hand",
    about: "SoftHand reaches into a box of 30 mixed objects, 50 g to 1 kg, closes and lifts",
    peers: true,
    run: thirty_objects,
}];

/// Inner half width and height of the box, m.
const HALF_M: f64 = 0.14;
const HEIGHT_M: f64 = 0.25;
/// How long the pile settles before the case begins, s, and the step it does so with: every run of the case starts
/// from the same pile.
const SETTLE_S: f64 = 2.5;
const SETTLE_STEP_S: f64 = 1e-3;

/// Convex parts of an object that fits into a sphere of 4.5 cm radius.
type Parts = Vec<(Pose, Shape)>;

/// An object of one of six kinds, by turns.
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
fn add_box(model: &mut Model) -> Result<()> {
    let t = 0.01;
    let (w, h) = (HALF_M, 0.5 * HEIGHT_M);
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

/// `count` random objects and where they lie when our own world has settled them.
fn settled(count: usize, seed: u64) -> Result<(Vec<Arc<Object>>, Vec<Pose>)> {
    let mut random = Random::new(seed);
    let mut model = Model::new(Config::with_step(SETTLE_STEP_S), None)?;
    add_box(&mut model)?;
    let (mut objects, mut poses) = (Vec::new(), Vec::new());
    for k in 0..count {
        let mass = random.magnitude(0.05, 1.0);
        let object = Arc::new(Object::new(format!("object_{k}"), parts(k, &mut random), mass, 0.6, 5e-4)?);
        // Layers of nine, none of which can touch another.
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

/// The hand comes down into the pile, closes and rises, over 4.5 s. The figure is how far the centre of an object
/// got out of the box's inner planes: nothing may pass through a wall or the floor. What the hand has carried
/// above the rim may fall anywhere but through the floor.
pub fn thirty_objects(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (objects, poses) = settled(30, 30)?;
    let mut model = Model::new(Config::with_step(setup.dt_s), Some(softhand()?))?;
    add_box(&mut model)?;
    for object in objects {
        model.add_object(object)?;
    }
    // Fingers down, palm towards -x.
    let down = Rotation::from_rotation_y(std::f64::consts::PI);
    let top = Pose::from_parts(Vec3::new(0.03, -0.03, 0.5), down);
    let state = State::at_rest(&model, top, &poses);
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), top);
    let mut escaped: f64 = 0.0;
    let mut carried_out = vec![false; poses.len()];
    for k in 0..steps(4.5, setup.dt_s) {
        let t = (k + 1) as f64 * setup.dt_s;
        let (sink, sinking) = ramp(t / 1.5);
        let (rise, rising) = ramp((t - 2.7) / 1.3);
        let depth = 0.24;
        command.sigma[0] = ramp((t - 1.6) / 0.8).0;
        command.base = BaseCommand::Exact(BaseReference {
            pose: Pose::from_parts(top.translation + Vec3::new(0.0, 0.0, depth * (rise - sink)), down),
            linear: Vec3::new(0.0, 0.0, depth * (rising / 1.3 - sinking / 1.5)),
            angular: Vec3::ZERO,
        });
        recorder.step(&mut *world, &command)?;
        for (pose, out) in world.state().objects.iter().zip(&mut carried_out) {
            let p = pose.translation;
            *out |= p.z > HEIGHT_M;
            if !*out {
                escaped = escaped.max(p.x.abs() - HALF_M).max(p.y.abs() - HALF_M);
            }
            escaped = escaped.max(-p.z);
        }
    }
    Ok(Finding {
        error: Figure::new("farthest object centre beyond a wall", escaped * 1e3, "mm"),
        invariants: recorder.invariants(),
    })
}
