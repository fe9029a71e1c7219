//! Surfaces with restitution.

use crate::{Command, Config, Model, State, World};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use std::sync::Arc;

fn dropped(restitution: f64, height: f64, step_s: f64) -> World {
    let mut model = Model::new(Config::with_step(step_s), None).expect("an empty world");
    let floor = Shape::Box { half_extents: [1.0, 1.0, 0.1], rounding: 0.0 };
    model.add_static("floor", &floor, Pose::translation(0.0, 0.0, -0.1), 0.5).expect("a floor");
    let ball = Object::new("ball", vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })], 1.0, 0.5, 0.0)
        .expect("a ball")
        .with_restitution(restitution);
    model.add_object(Arc::new(ball)).expect("it fits");
    let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, 0.05 + height)]);
    World::new(Arc::new(model), state)
}

/// A ball dropped from h₀ reaches e² h₀ after its first rebound.
#[test]
fn a_ball_rebounds_to_the_square_of_its_restitution() {
    for e in [0.25, 0.5, 0.8, 1.0] {
        let mut world = dropped(e, 1.0, 1e-3);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        let (mut risen, mut apex) = (false, 0.0f64);
        for _ in 0..1200 {
            world.step(&command);
            risen |= world.state().v[2] > 0.0;
            if risen {
                if world.state().v[2] < 0.0 {
                    break;
                }
                apex = apex.max(world.state().objects[0].translation.z - 0.05);
            }
        }
        assert!((apex / (e * e) - 1.0).abs() < 5e-3, "e = {e}: apex {apex}");
    }
}

/// A perfectly elastic ball keeps its energy over many rebounds, and one with e = 0.8 comes to rest after
/// √(2 h₀/g) (1 + e)/(1 − e).
#[test]
fn energy_stays_and_rest_comes() {
    let mut world = dropped(1.0, 0.5, 1e-3);
    let command = Command::stay(world.model(), Pose::IDENTITY);
    let energy = |world: &World| {
        let v = Vec3::new(world.state().v[0], world.state().v[1], world.state().v[2]);
        0.5 * v.length_squared() + 9.81 * (world.state().objects[0].translation.z - 0.05)
    };
    let start = energy(&world);
    for _ in 0..10_000 {
        world.step(&command);
    }
    let drift = energy(&world) / start - 1.0;
    assert!(drift.abs() < 5e-3, "{drift}");
    let mut world = dropped(0.8, 1.0, 1e-3);
    let mut last = 0.0;
    for k in 0..6_000 {
        world.step(&command);
        if world.state().v[2].abs() > 0.02 {
            last = f64::from(k) * 1e-3;
        }
    }
    assert!((last - 4.06).abs() < 0.2, "at rest after {last} s");
}

#[test]
fn without_restitution_nothing_jumps() {
    let mut world = dropped(0.0, 0.2, 1e-3);
    let command = Command::stay(world.model(), Pose::IDENTITY);
    for _ in 0..2000 {
        world.step(&command);
        assert!(world.state().v[2] < 0.5);
    }
}
