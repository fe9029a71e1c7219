//! Instructions per scene, counted by callgrind: the same on a busy and on an idle machine, so that a change that
//! makes the step slower shows in the tests.
//!
//! Each count is over [`STEPS`] steps. A limit is 3 to 5 % above the count of the commit that set it. Raise
//! a limit only with a reason in the commit's message; lower it when a change pays.

// The macros of gungraun write modules without documentation.
#![allow(missing_docs)]

use gungraun::{
    Callgrind, EventKind, LibraryBenchmarkConfig, library_benchmark, library_benchmark_group, main,
};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State, World};
use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::sync::Arc;

/// Steps of 1 ms that are counted.
const STEPS: usize = 50;

/// The built-in hand with firm springs and a strong drive that no load slows: the counts do not move with its calibration.
fn softhand() -> Arc<Hand> {
    let mut hand = Hand::clone(&*Hand::builtin("softhand").expect("it is built in"));
    hand.coordinates.iter_mut().for_each(|coordinate| coordinate.stiffness *= 2.0);
    (hand.tendons[0].force_limit, hand.motors[0].speed_limit) = (2.0, 2.0);
    (hand.motors[0].stall_force, hand.motors[0].power_limit) = (None, None);
    Arc::new(hand)
}

fn object(shape: Shape, mass: f64) -> Arc<Object> {
    Arc::new(Object::new("object", vec![(Pose::IDENTITY, shape)], mass, 0.8, 0.0).expect("a sound object"))
}

/// The world after `time_s` of closing to `sigma`, and the command that continues the motion.
fn closed(model: Model, base: Pose, objects: &[Pose], sigma: f64, time_s: f64) -> (World, Command) {
    let state = State::at_rest(&model, base, objects);
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), base);
    command.sigma[0] = sigma;
    for _ in 0..(time_s / 1e-3) as u32 {
        world.step(&command);
    }
    (world, command)
}

/// The hand closes in free air.
fn free() -> (World, Command) {
    let model = Model::new(Config::default(), Some(softhand())).expect("a hand");
    closed(model, Pose::IDENTITY, &[], 0.4, 0.1)
}

/// The hand, palm down, has closed around a cylinder, lifted it off its pedestal and holds it.
fn cylinder() -> (World, Command) {
    let mut model = Model::new(Config::default(), Some(softhand())).expect("a hand");
    let pedestal = Shape::Box { half_extents: [0.02; 3], rounding: 0.0 };
    model.add_static("pedestal", &pedestal, Pose::translation(0.0, 0.0, -0.06), 0.5).expect("furniture");
    let shape = Shape::Cylinder { radius: 0.04, half_length: 0.035 };
    model.add_object(object(shape, 0.1)).expect("it fits");
    let down = Rotation::from_rotation_y(FRAC_PI_2);
    let lying = Rotation::from_rotation_x(FRAC_PI_2);
    let center = Vec3::new(0.056, -0.01, 0.148);
    let base = Pose::from_parts(-(down * center), down);
    let (mut world, _) = closed(model, base, &[Pose::from_parts(Vec3::ZERO, down * lying)], 0.9, 0.6);
    let lifted = Pose::from_parts(base.translation + Vec3::new(0.0, 0.0, 0.05), down);
    let mut command = Command::stay(world.model(), lifted);
    command.sigma[0] = 0.9;
    for _ in 0..600 {
        world.step(&command);
    }
    assert!(world.state().objects[0].translation.z > 0.04, "the hand holds the cylinder");
    (world, command)
}

/// The hand digs in a heap of balls in a box.
fn balls() -> (World, Command) {
    let mut model = Model::new(Config::default(), Some(softhand())).expect("a hand");
    let slabs = [
        ([0.0, 0.0, -0.01], [0.2, 0.2, 0.01]),
        ([0.16, 0.0, 0.1], [0.01, 0.2, 0.1]),
        ([-0.16, 0.0, 0.1], [0.01, 0.2, 0.1]),
        ([0.0, 0.16, 0.1], [0.2, 0.01, 0.1]),
        ([0.0, -0.16, 0.1], [0.2, 0.01, 0.1]),
    ];
    for (at, half_extents) in slabs {
        let wall = Shape::Box { half_extents, rounding: 0.0 };
        model.add_static("box", &wall, Pose::from_translation(Vec3::from_array(at)), 0.5).expect("a wall");
    }
    let mut poses = Vec::new();
    for k in 0..12 {
        model.add_object(object(Shape::Sphere { radius: 0.04 }, 0.3)).expect("it fits");
        let (x, y, layer) = (k % 3, k / 3 % 2, k / 6);
        // A little off the grid, so that they roll.
        let off = 0.002 * f64::from(k);
        poses.push(Pose::translation(
            0.09 * f64::from(x) - 0.09 + off,
            0.1 * f64::from(y) - 0.05,
            0.05 + 0.09 * f64::from(layer),
        ));
    }
    let down = Rotation::from_rotation_y(std::f64::consts::PI);
    let base = Pose::from_parts(Vec3::new(0.02, 0.0, 0.42), down);
    let (mut world, _) = closed(model, base, &poses, 0.0, 0.4);
    let mut command = Command::stay(world.model(), Pose::from_parts(Vec3::new(0.02, 0.0, 0.24), down));
    command.sigma[0] = 0.8;
    for _ in 0..400 {
        world.step(&command);
    }
    assert!(world.outcome().points > 20, "the hand is in the heap");
    (world, command)
}

fn limit(instructions: u64) -> LibraryBenchmarkConfig {
    let mut callgrind = Callgrind::default();
    callgrind.hard_limits([(EventKind::Ir, instructions)]);
    let mut config = LibraryBenchmarkConfig::default();
    config.tool(callgrind);
    config
}

fn steps((mut world, command): (World, Command)) -> World {
    for _ in 0..STEPS {
        black_box(world.step(black_box(&command)));
    }
    world
}

#[library_benchmark(config = limit(4_700_000))]
#[bench::run(free())]
fn free_closing(scene: (World, Command)) -> World {
    steps(scene)
}

#[library_benchmark(config = limit(6_060_000))]
#[bench::run(cylinder())]
fn cylinder_held(scene: (World, Command)) -> World {
    steps(scene)
}

#[library_benchmark(config = limit(43_700_000))]
#[bench::run(balls())]
fn heap_of_balls(scene: (World, Command)) -> World {
    steps(scene)
}

library_benchmark_group!(name = instructions; benchmarks = free_closing, cylinder_held, heap_of_balls);
main!(library_benchmark_groups = instructions);
