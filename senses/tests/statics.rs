//! What is felt at rest and while something is lifted, against the weights that are there.

use palmares_models::hand::sensors::Accelerometer;
use palmares_models::hand::{Hand, TactilePatch};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::Senses;
use palmares_sim::actuation::motor::wound;
use palmares_sim::state::BaseReference;
use palmares_sim::{BaseCommand, Command, Config, Model, State, World};
use std::sync::Arc;

const G: f64 = 9.81;
const TICK_S: f64 = 0.01;

/// A ReFlex on its back whose palm is one patch from edge to edge, and on it a block of half a kilogram.
fn palm_up() -> (Arc<Hand>, World, Senses) {
    let mut hand = Hand::clone(&Hand::builtin("reflex").expect("built in"));
    let link = hand.tactile.iter().find(|patch| patch.name == "palm_front").expect("a palm").link;
    let link_from_patch = Pose::translation(0.0, 0.0, 0.082);
    let name = "palm".to_owned();
    hand.tactile =
        vec![TactilePatch { name, link, link_from_patch, half_size: [0.05, 0.045], taxels: [10, 9] }];
    let hand = Arc::new(hand);
    let mut model = Model::new(Config::default(), Some(hand.clone())).expect("a model");
    let block = Shape::Box { half_extents: [0.02, 0.018, 0.03], rounding: 0.001 };
    let block = Object::new("block", vec![(Pose::IDENTITY, block)], 0.5, 0.8, 0.0).expect("an object");
    model.add_object(Arc::new(block)).expect("added");
    let model = Arc::new(model);
    let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.003, 0.004, 0.1125)]);
    let world = World::new(model, state);
    let senses = Senses::new(hand.clone(), &world, TICK_S, None);
    (hand, world, senses)
}

fn stay(hand: &Hand) -> Command {
    let sigma = vec![0.0; hand.motors.len()];
    Command { base: BaseCommand::stay(Pose::IDENTITY), sigma, pushes: Vec::new() }
}

fn mass(hand: &Hand) -> f64 {
    hand.links.iter().map(|link| link.inertia.mass).sum()
}

#[test]
fn half_a_kilogram_on_the_palm_weighs_what_it_weighs_and_does_not_flicker() {
    let (hand, mut world, senses) = palm_up();
    let command = stay(&hand);
    for _ in 0..2000 {
        world.step(&command);
    }
    let first = senses.read(&world);
    let weight: f64 = first.touch.iter().map(|taxel| taxel[2]).sum();
    assert!((weight - 0.5 * G).abs() < 1e-6, "{weight}");
    // The servo gives way a little: in the tilted palm's frame the weight has a part along the surface.
    let felt = first.touch.iter().fold(Vec3::ZERO, |sum, [x, y, z]| sum + Vec3::new(*x, *y, -z));
    let felt = world.state().base.rotation * felt;
    assert!(felt.x.abs() < 1e-6 && felt.y.abs() < 1e-6, "{felt:?}");
    let lit = first.touch.iter().filter(|taxel| taxel[2] > 1e-3).count();
    assert!(lit >= 8, "four corners light more than one taxel each: {lit}");
    for _ in 0..1000 {
        world.step(&command);
        let now = senses.read(&world);
        let change = |(a, b): (&[f64; 3], &[f64; 3])| (a[2] - b[2]).abs();
        let most = now.touch.iter().zip(&first.touch).map(change).fold(0.0, f64::max);
        assert!(most < 1e-6, "{most}");
    }
}

#[test]
fn the_wrist_carries_hand_and_block_at_rest_and_while_they_are_lifted() {
    let (hand, mut world, senses) = palm_up();
    let mut command = stay(&hand);
    for _ in 0..2000 {
        world.step(&command);
    }
    let all = mass(&hand) + 0.5;
    let (force, _) = senses.read(&world).wrist;
    assert!((force[2] - all * G).abs() < 1e-6 * all * G, "{} {}", force[2], all * G);
    assert!(force[0].abs() < 1e-6 && force[1].abs() < 1e-6, "{force:?}");
    let acceleration = 0.8;
    for k in 1..=500 {
        let t = 1e-3 * f64::from(k);
        command.base = BaseCommand::Exact(BaseReference {
            pose: Pose::translation(0.0, 0.0, 0.5 * acceleration * t * t),
            linear: Vec3::new(0.0, 0.0, acceleration * t),
            angular: Vec3::ZERO,
        });
        world.step(&command);
        if k > 250 {
            let (force, _) = senses.read(&world).wrist;
            let inertial = force[2] - all * G;
            assert!((inertial / (all * acceleration) - 1.0).abs() < 0.01, "at {t} s: {inertial}");
        }
    }
}

/// An accelerometer at rest feels what keeps it from falling, and while it is lifted the lifting as well.
#[test]
fn an_accelerometer_feels_weight_and_lifting() {
    let mut hand = Hand::clone(&Hand::builtin("reflex").expect("built in"));
    let link = hand.links[0].name.clone();
    hand.sensors.accelerometer = Some(Accelerometer { link, range: 40.0, noise: 0.0, bias: 0.0 });
    let hand = Arc::new(hand);
    let model = Arc::new(Model::new(Config::default(), Some(hand.clone())).expect("a model"));
    let turned = Rotation::from_scaled_axis(Vec3::X * 0.7);
    let state = State::at_rest(&model, Pose::from_rotation(turned), &[]);
    let mut world = World::new(model, state);
    let mut senses = Senses::new(hand.clone(), &world, TICK_S, None);
    let (mut command, acceleration) = (stay(&hand), 0.8);
    for tick in 1..=60 {
        for k in 1..=10 {
            let t = 1e-3 * f64::from(10 * (tick - 1) + k);
            command.base = BaseCommand::Exact(BaseReference {
                pose: Pose::from_parts(Vec3::Z * (0.5 * acceleration * t * t), turned),
                linear: Vec3::Z * (acceleration * t),
                angular: Vec3::ZERO,
            });
            world.step(&command);
        }
        senses.tick(&world, tick as u64);
    }
    let felt = Vec3::from_array(senses.read(&world).acceleration.expect("it has one"));
    let expected = turned.inverse() * (Vec3::Z * (G + acceleration));
    assert!((felt - expected).length() < 0.02, "{felt:?} {expected:?}");
    // Beyond its range it tells the end of its range.
    let mut narrow = Hand::clone(&hand);
    narrow.sensors.accelerometer.as_mut().expect("it has one").range = 3.0;
    let mut senses = Senses::new(Arc::new(narrow), &world, TICK_S, None);
    senses.tick(&world, 61);
    let felt = senses.read(&world).acceleration.expect("it has one");
    assert!(felt.iter().all(|x| x.abs() <= 3.0) && felt[2] == 3.0, "{felt:?}");
}

/// A tendon's tension is what its servo pulls with: stiffness times what is wound up and not yet taken by the joints.
#[test]
fn tension_is_what_the_motor_pulls_with() {
    let (hand, mut world, senses) = palm_up();
    let mut command = stay(&hand);
    command.sigma = vec![0.3, 0.4, 0.35, 0.2];
    for _ in 0..4000 {
        world.step(&command);
    }
    let state = world.state();
    for (tendon, k) in hand.tendons.iter().zip(0..) {
        let motor = tendon.motor;
        let taken: f64 = tendon.length(&state.q);
        let pull = tendon.stiffness * (wound(&hand.motors[motor], state.motors[motor].position) - taken);
        let tension = senses.read(&world).motors[motor].tension;
        let clamped =
            pull.clamp(if tendon.both_ways { -tendon.force_limit } else { 0.0 }, tendon.force_limit);
        assert!((tension - clamped).abs() < 1e-6 * (1.0 + clamped.abs()), "{k}: {tension} {clamped}");
    }
}
