//! Contacts that the search leaves out, and that a long step reaches all the same.

use crate::{BaseCommand, Command, Config, Model, Push, State, World};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use std::sync::Arc;

/// Two blocks on a plate are one island. One is pushed so hard that it would go twice as far as the other one is away, which the short
/// reach does not hold.
#[test]
fn what_a_step_reaches_joins_before_anything_moves() {
    let (half, gap, mass) = (0.02, 2e-3, 0.1);
    for step_s in [4e-3, 8e-3, 16e-3] {
        let mut model = Model::new(Config::with_step(step_s), None).expect("an empty world");
        model.add_ground(0.0, 0.5);
        let object = |name: &str, half_extents: [f64; 3], mass: f64| {
            let shape = Shape::Box { half_extents, rounding: 0.0 };
            Arc::new(Object::new(name, vec![(Pose::IDENTITY, shape)], mass, 0.5, 0.0).expect("sound"))
        };
        model.add_object(object("plate", [0.2, 0.1, 0.01], 5.0)).expect("it fits");
        model.add_object(object("pushed", [half; 3], mass)).expect("it fits");
        model.add_object(object("met", [half; 3], mass)).expect("it fits");
        let at = |x: f64| Pose::translation(x, 0.0, 0.02 + half);
        let poses = [Pose::translation(0.0, 0.0, 0.01), at(-half), at(half + gap)];
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        let mut world = World::new(Arc::new(model), state);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        for _ in 0..3 {
            world.step(&command);
        }
        let force = mass * 2.0 * gap / (step_s * step_s);
        world.push_object(1, Vec3::X * force, Vec3::ZERO);
        world.step(&command);
        let [pushed, met] = [1, 2].map(|k| world.state().objects[k].translation.x);
        let left = met - pushed - 2.0 * half;
        // Alone it would overlap by the gap. The contact yields by some F/k, and the block tips a little.
        assert!(left > -0.1 * gap, "h {step_s}: {left:e} m");
        assert!(world.state().object_velocity(world.model(), 2).0.x > 0.0, "h {step_s}: it is pushed on");
    }
}

/// The hand at rest without weight and with a free base, over a ground at this height, m.
fn hand_over(height: f64, step_s: f64) -> (World, Command) {
    let config = Config { gravity: Vec3::ZERO, ..Config::with_step(step_s) };
    let hand = Hand::builtin("softhand").expect("it is built in");
    let mut model = Model::new(config, Some(hand)).expect("a hand");
    model.add_ground(height, 0.5);
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.base = BaseCommand::Free;
    (world, command)
}

/// The pairs of the hand with furniture wait for the solution. Nothing else is left out here: a push takes the palm through the ground,
/// which is farther off than the short reach.
#[test]
fn what_the_hand_alone_reaches_joins_before_it_moves() {
    let touches = |height: f64| {
        let (mut world, command) = hand_over(height, 1e-5);
        world.step(&command).penetration_m > 0.0
    };
    let (mut below, mut above) = (-0.5, 0.0);
    assert!(!touches(below) && touches(above), "the ground is below the hand, or in it");
    for _ in 0..40 {
        let middle = 0.5 * (below + above);
        if touches(middle) { above = middle } else { below = middle }
    }
    let gap = 2e-3;
    for step_s in [8e-3, 16e-3] {
        let (mut world, mut command) = hand_over(below - gap, step_s);
        let mass: f64 =
            world.model().hand().map_or(0.0, |hand| hand.links.iter().map(|link| link.inertia.mass).sum());
        let force = -Vec3::Z * (mass * 2.0 * gap / (step_s * step_s));
        command.pushes = vec![Push { link: 0, point: Vec3::ZERO, force }];
        world.step(&command);
        command.pushes.clear();
        let overlap = world.step(&command).penetration_m;
        assert!(overlap < 0.1 * gap, "h {step_s}: {overlap:e} m");
    }
}
