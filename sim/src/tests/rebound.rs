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

fn bouncy(radius: f64, mass: f64, restitution: f64) -> Arc<Object> {
    let shape = vec![(Pose::IDENTITY, Shape::Sphere { radius })];
    Arc::new(Object::new("ball", shape, mass, 0.3, 0.0).expect("a ball").with_restitution(restitution))
}

/// Kinetic energy of the balls and that of their height.
fn energy(world: &World) -> f64 {
    let (model, state) = (world.model(), world.state());
    let mut sum = 0.0;
    for (k, object) in model.objects().iter().enumerate() {
        let (linear, angular) = state.object_velocity(model, k);
        let height = -model.config().gravity.dot(state.objects[k].translation);
        let spin = object.inertia.x_axis.x * angular.length_squared();
        sum += object.mass * (0.5 * linear.length_squared() + height) + 0.5 * spin;
    }
    sum
}

/// A flying ball hits a row of touching balls at rest: with every step length, the last one takes all the
/// momentum.
#[test]
fn a_row_of_balls_hands_an_impact_on() {
    for step_s in [0.125e-3, 1e-3, 4e-3, 16e-3] {
        let config = Config { gravity: Vec3::ZERO, sleeping: false, ..Config::with_step(step_s) };
        let mut model = Model::new(config, None).expect("an empty world");
        let mut poses = Vec::new();
        for k in 0..5 {
            model.add_object(bouncy(0.02, 0.1, 1.0)).expect("it fits");
            let away = if k == 0 { 0.0313 } else { 0.0 };
            poses.push(Pose::translation(0.04 * f64::from(k) - away, 0.0, 0.0));
        }
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        let mut world = World::new(Arc::new(model), state);
        world.state_mut().v[0] = 1.0;
        let command = Command::stay(world.model(), Pose::IDENTITY);
        for _ in 0..(0.1 / step_s) as usize {
            world.step(&command);
        }
        for (k, exact) in [0.0, 0.0, 0.0, 0.0, 1.0].into_iter().enumerate() {
            let (v, _) = world.state().object_velocity(world.model(), k);
            assert!((v - Vec3::X * exact).length() < 1e-5, "ball {k} at {step_s}: {v}");
        }
        let last = world.state().objects[4].translation.x;
        let flown = world.state().step as f64 * step_s - 0.0313;
        assert!((last - 0.16 - flown).abs() < 1e-5, "at {step_s}: {last} after {flown}");
    }
}

/// A ball falls on one that is about to land on a third, which rests on the floor. The sequence of impacts
/// does not include the floor; the floor must not make the balls jump.
#[test]
fn nothing_is_won_from_what_stands_behind() {
    for step_s in [0.5e-3, 1e-3, 4e-3] {
        let config = Config { contact_stiffness: 1e8, ..Config::with_step(step_s) };
        let mut model = Model::new(config, None).expect("an empty world");
        let floor = Shape::Box { half_extents: [1.0, 1.0, 0.1], rounding: 0.0 };
        model.add_static("floor", &floor, Pose::translation(0.0, 0.0, -0.1), 0.5).expect("a floor");
        for _ in 0..3 {
            model.add_object(bouncy(0.05, 0.5, 1.0)).expect("it fits");
        }
        let poses = [0.05 - 4.9e-8, 0.15 + 1e-4, 0.25 + 3e-4].map(|z| Pose::translation(0.0, 0.0, z));
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        let mut world = World::new(Arc::new(model), state);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        // So that the floor is known to carry the first.
        world.step(&command);
        world.state_mut().v[14] = -1.0;
        let start = energy(&world);
        for k in 0..20 {
            world.step(&command);
            let gain = energy(&world) - start;
            // Compared with the 0.25 J that fall; the impacts alone would add as much again.
            assert!(gain < 0.01, "{gain} J from nowhere at {step_s}, step {k}");
        }
    }
}

/// Fast elastic balls without friction in a closed box: no energy is gained, and little is lost in
/// simultaneous impacts.
#[test]
fn a_gas_of_balls_keeps_its_energy() {
    for step_s in [0.25e-3, 1e-3, 4e-3, 16e-3] {
        let config = Config { gravity: Vec3::ZERO, ..Config::with_step(step_s) };
        let mut model = Model::new(config, None).expect("an empty world");
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let mut half_extents = [0.4; 3];
                half_extents[axis] = 0.1;
                let mut at = [0.0; 3];
                at[axis] = side * 0.3;
                let wall = Shape::Box { half_extents, rounding: 0.0 };
                model.add_static("wall", &wall, Pose::translation(at[0], at[1], at[2]), 0.0).expect("a wall");
            }
        }
        let mut poses = Vec::new();
        for k in 0..64 {
            let ball =
                Object::new("ball", vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.03 })], 0.2, 0.0, 0.0);
            model.add_object(Arc::new(ball.expect("a ball").with_restitution(1.0))).expect("it fits");
            let [x, y, z] = [k % 4, k / 4 % 4, k / 16].map(|i| f64::from(i) * 0.08 - 0.12);
            poses.push(Pose::translation(x, y, z));
        }
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        let mut world = World::new(Arc::new(model), state);
        for k in 0..64 {
            for axis in 0..3 {
                world.state_mut().v[6 * k + axis] = libm::sin(3.7 * (3 * k + axis) as f64 + 0.3);
            }
        }
        let command = Command::stay(world.model(), Pose::IDENTITY);
        let start = energy(&world);
        for _ in 0..(2.0 / step_s) as usize {
            world.step(&command);
            assert!(energy(&world) < start * (1.0 + 1e-9), "at {step_s}: {} J of {start} J", energy(&world));
        }
        let left = energy(&world) / start;
        assert!(left > if step_s > 1e-3 { 0.95 } else { 0.999 }, "at {step_s}: {left} is left");
    }
}
