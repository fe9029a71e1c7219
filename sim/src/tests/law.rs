//! Laws that are left out: each changes the course of a scene in which it acts, and no bit of one in which it does not.

use crate::{Command, Config, Law, Model, State, Tally, World};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::sync::Arc;

/// Steps of 1 ms of each scene.
const STEPS: usize = 500;

/// A scene: its model, its start, and the set point of the motor.
type Scene = (Model, State, f64);

fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    Shape::Box { half_extents: [0.5 * x, 0.5 * y, 0.5 * z], rounding: 0.0 }
}

/// A body: its shape, its restitution, its lever of torsional friction, m, its pose and its velocities.
type Body = (Shape, [f64; 2], Pose, [f64; 6]);

/// Bodies of 0.2 kg on a ground.
fn bodies(list: Vec<Body>) -> Scene {
    let mut model = Model::new(Config::default(), None).expect("an empty world");
    model.add_ground(0.0, 0.5);
    let (mut poses, mut v) = (Vec::new(), Vec::new());
    for (shape, [restitution, lever], pose, velocity) in list {
        let object = Object::new("body", vec![(Pose::IDENTITY, shape)], 0.2, 0.5, 0.0).expect("sound");
        let object = object.with_restitution(restitution);
        let object = object.with_torsional_friction(lever).expect("valid");
        model.add_object(Arc::new(object)).expect("it fits");
        poses.push(pose);
        v.extend(velocity);
    }
    let mut state = State::at_rest(&model, Pose::IDENTITY, &poses);
    state.v = v;
    (model, state, 0.0)
}

/// A block slides, turns and comes to rest beside a ball that spins; another ball falls on the block.
fn sliding() -> Scene {
    let ball = Shape::Sphere { radius: 0.03 };
    bodies(vec![
        (cuboid(0.1, 0.1, 0.04), [0.0; 2], Pose::translation(0.0, 0.0, 0.02), [0.3, 0.0, 0.0, 0.0, 0.0, 5.0]),
        (ball.clone(), [0.0, 5e-3], Pose::translation(0.0, 0.5, 0.03), [0.0, 0.0, 0.0, 0.0, 0.0, 20.0]),
        (ball, [0.0; 2], Pose::translation(0.02, 0.0, 0.15), [0.0; 6]),
    ])
}

/// A block rocks from edge to edge.
fn rocking() -> Scene {
    let turn = Rotation::from_rotation_y(0.18);
    let at = -(turn * Vec3::new(0.02, 0.0, -0.06));
    bodies(vec![(cuboid(0.04, 0.1, 0.12), [0.0; 2], Pose::from_parts(at, turn), [0.0; 6])])
}

/// A thin rod spins fast while it falls on a thin plate, and another falls past the plate's edge.
fn fast() -> Scene {
    let (mut model, state, sigma) = bodies(vec![
        (
            cuboid(0.3, 0.004, 0.004),
            [0.0; 2],
            Pose::translation(0.0, 0.0, 0.26),
            [0.0, 0.0, -4.0, 0.0, 300.0, 0.0],
        ),
        (
            cuboid(0.02, 0.02, 0.02),
            [0.0; 2],
            Pose::translation(0.1105, 0.3, 0.225),
            [0.0, 0.0, -3.0, 0.0, 0.0, 0.0],
        ),
    ]);
    model
        .add_static("plate", &cuboid(0.2, 0.8, 0.004), Pose::translation(0.0, 0.0, 0.2), 0.5)
        .expect("a plate");
    (model, state, sigma)
}

/// Rods that slide and turn rebound from the ground.
fn rebounding() -> Scene {
    let rod = |k: u32| {
        let (along, lean) = (f64::from(k % 4) - 1.5, 0.1 + 0.35 * f64::from(k / 4));
        let pose = Pose::from_parts(Vec3::new(0.0, f64::from(k), 0.12), Rotation::from_rotation_y(lean));
        (cuboid(0.2, 0.02, 0.02), [0.9, 0.0], pose, [2.0 * along, 0.3, -2.0, 1.0, 10.0 * along, 3.0])
    };
    bodies((0..16).map(rod).collect())
}

/// The SoftHand closes in the air until its fingers touch the palm.
fn closing() -> Scene {
    let hand = Hand::builtin("softhand").expect("it is built in");
    let model = Model::new(Config::default(), Some(hand)).expect("a hand");
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    (model, state, 1.0)
}

/// Hash of the state after the scene without a law, if any, and the laws that acted.
fn play((mut model, state, sigma): Scene, without: Option<Law>) -> (u64, Tally) {
    without.into_iter().for_each(|law| model.leave_out(law));
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.sigma.fill(sigma);
    let mut tally = Tally::default();
    for _ in 0..STEPS {
        world.step(&command);
        tally.add(&world);
    }
    assert_eq!(world.fault(), None);
    (world.state().hash(), tally)
}

#[test]
fn a_law_that_is_left_out_changes_a_course_where_it_acts_and_nothing_else() {
    let scenes: [fn() -> Scene; 5] = [sliding, rocking, fast, rebounding, closing];
    let whole: Vec<(u64, Tally)> = scenes.iter().map(|scene| play(scene(), None)).collect();
    let mut wrong = Vec::new();
    for &law in Law::ALL {
        let mut acts = 0;
        for (k, (scene, (hash, tally))) in scenes.iter().zip(&whole).enumerate() {
            let (without, left) = play(scene(), Some(law));
            if left.acted(law) > 0 {
                wrong.push(format!("{} acts in scene {k} although it is left out", law.name()));
            }
            if (without != *hash) != (tally.acted(law) > 0) {
                wrong.push(format!("{} acts in {} steps of scene {k}", law.name(), tally.acted(law)));
            }
            acts += tally.acted(law);
        }
        if acts == 0 {
            wrong.push(format!("{} acts in no scene", law.name()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A hand that joins a scene finds its laws left out.
#[test]
fn a_scene_with_another_hand_leaves_out_the_same_laws() {
    let (mut model, ..) = closing();
    Law::ALL.iter().for_each(|law| model.leave_out(*law));
    let model = model.with_hand(Hand::builtin("softhand").expect("it is built in")).expect("a hand");
    assert!(Law::ALL.iter().all(|law| !model.has(*law)));
    assert!(model.self_pairs().is_empty() && !model.config().sleeping);
}
