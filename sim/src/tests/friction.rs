//! Friction of different surfaces: the geometric mean of their coefficients, in either order.

use crate::{Command, Config, Model, State, World};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::sync::Arc;

const BLOCK: [f64; 3] = [0.1, 0.1, 0.02];

/// Distance that a block of friction `upper` slides within half a second on a block of friction `lower`,
/// which rests on a floor of friction `floor`, and that of the lower block on the floor, m. Gravity leans by
/// `slope` of its weight.
fn slides(upper: f64, lower: f64, floor: f64, slope: f64) -> [f64; 2] {
    let gravity = Vec3::new(9.81 * slope, 0.0, -9.81);
    let mut model = Model::new(Config { gravity, ..Config::default() }, None).expect("no hand");
    let slab = Shape::Box { half_extents: [2.0, 2.0, 0.05], rounding: 0.0 };
    model.add_static("floor", &slab, Pose::translation(0.0, 0.0, -0.05), floor).expect("furniture");
    for (name, friction) in [("lower", lower), ("upper", upper)] {
        let parts = vec![(Pose::IDENTITY, Shape::Box { half_extents: BLOCK, rounding: 0.0 })];
        let object = Object::new(name, parts, 1.0, friction, 0.0).expect("a block");
        model.add_object(Arc::new(object)).expect("it fits");
    }
    let poses = [0.02, 0.06].map(|z| Pose::translation(0.0, 0.0, z));
    let state = State::at_rest(&model, Pose::IDENTITY, &poses);
    let mut world = World::new(Arc::new(model), state);
    let stay = Command::stay(world.model(), Pose::IDENTITY);
    for _ in 0..500 {
        world.step(&stay);
    }
    let [low, high] = [0, 1].map(|k| world.state().objects[k].translation.x);
    [high - low, low]
}

#[test]
fn a_block_slides_on_another_beyond_the_geometric_mean_of_both() {
    // √(0.1 · 0.9) = 0.3; the lower one sticks to the floor.
    assert!(slides(0.1, 0.9, 2.0, 0.29)[0] < 1e-4);
    assert!(slides(0.1, 0.9, 2.0, 0.31)[0] > 1e-2);
    // The result is the same in the other order.
    assert!(slides(0.9, 0.1, 20.0, 0.29)[0] < 1e-4);
    assert!(slides(0.9, 0.1, 20.0, 0.31)[0] > 1e-2);
}

#[test]
fn a_block_slides_on_furniture_beyond_the_geometric_mean_of_both() {
    assert!(slides(2.0, 0.9, 0.1, 0.29)[1] < 1e-4);
    assert!(slides(2.0, 0.9, 0.1, 0.31)[1] > 1e-2);
}

#[test]
fn a_frictionless_surface_slides_on_everything() {
    assert!(slides(2.0, 0.0, 5.0, 0.1)[1] > 0.1);
    assert!(slides(0.0, 2.0, 5.0, 0.1)[0] > 0.1);
}

/// Remaining part of a ball's spin about the vertical after half a second on a floor.
fn spin_left(rolling_friction: f64, torsional_friction: f64) -> f64 {
    let mut model = Model::new(Config { sleeping: false, ..Config::default() }, None).expect("no hand");
    model.add_ground(0.0, 0.5);
    let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })];
    let ball = Object::new("ball", parts, 1.0, 0.5, rolling_friction).expect("a ball");
    let ball = ball.with_torsional_friction(torsional_friction).expect("a length");
    model.add_object(Arc::new(ball)).expect("it fits");
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, 0.05)]);
    let spin = model.object_dofs(0) + 5;
    state.v[spin] = 20.0;
    let mut world = World::new(Arc::new(model), state);
    let stay = Command::stay(world.model(), Pose::IDENTITY);
    for _ in 0..500 {
        world.step(&stay);
    }
    world.state().v[spin] / 20.0
}

#[test]
fn rolling_resistance_brakes_no_spin_and_torsional_friction_does() {
    assert!((spin_left(2e-3, 0.0) - 1.0).abs() < 1e-6);
    // m g ρ / (2/5 m R²) = 9.81 rad/s².
    assert!((spin_left(0.0, 1e-3) - (1.0 - 0.5 * 9.81 / 20.0)).abs() < 2e-3);
}

/// Turn about the vertical of a thin slab that has fallen on a corner, degrees.
fn turned_by_a_fall(step_s: f64) -> f64 {
    let mut model =
        Model::new(Config { sleeping: false, ..Config::with_step(step_s) }, None).expect("no hand");
    model.add_ground(0.0, 0.5);
    let parts = vec![(Pose::IDENTITY, Shape::Box { half_extents: [0.08, 0.05, 0.004], rounding: 0.0 })];
    let slab = Object::new("slab", parts, 0.2, 0.5, 0.0).expect("a slab");
    model.add_object(Arc::new(slab)).expect("it fits");
    let tilted = Rotation::from_rotation_y(0.3) * Rotation::from_rotation_x(0.8);
    let start = Pose::from_parts(Vec3::new(0.0, 0.0, 0.09), tilted);
    let state = State::at_rest(&model, Pose::IDENTITY, &[start]);
    let mut world = World::new(Arc::new(model), state);
    let stay = Command::stay(world.model(), Pose::IDENTITY);
    for _ in 0..(0.6 / step_s) as usize {
        world.step(&stay);
    }
    let along = world.state().objects[0].rotation * Vec3::X;
    libm::atan2(along.y, along.x).to_degrees()
}

#[test]
fn what_falls_on_a_corner_turns_alike_at_every_step() {
    // With all friction at the pressed points it would be about 2: while one corner is struck and another
    // still bears, friction acts between them.
    for step_s in [0.25e-3, 1e-3, 4e-3] {
        let turned = turned_by_a_fall(step_s);
        assert!((-1.25..-0.85).contains(&turned), "{step_s}: {turned}");
    }
}
