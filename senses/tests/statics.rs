//! Readings at rest and while something is lifted, against the weights in the scene.

use palmares_models::hand::sensors::Accelerometer;
use palmares_models::hand::{Hand, TactilePatch};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::Sensors;
use palmares_sim::state::BaseReference;
use palmares_sim::{BaseCommand, Command, Config, Model, State, World};
use std::sync::Arc;

const G: f64 = 9.81;
const TICK_S: f64 = 0.01;

/// A ReFlex on its back whose palm is one patch from edge to edge, and on it a block of half a kilogram.
fn palm_up() -> (Arc<Hand>, World, Sensors) {
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
    let sensors = Sensors::new(hand.clone(), &world, TICK_S, None);
    (hand, world, sensors)
}

fn stay(hand: &Hand) -> Command {
    let sigma = vec![0.0; hand.motors.len()];
    Command { base: BaseCommand::stay(Pose::IDENTITY), sigma, effort: Vec::new(), pushes: Vec::new() }
}

fn mass(hand: &Hand) -> f64 {
    hand.links.iter().map(|link| link.inertia.mass).sum()
}

#[test]
fn half_a_kilogram_on_the_palm_weighs_what_it_weighs_and_does_not_flicker() {
    let (hand, mut world, sensors) = palm_up();
    let command = stay(&hand);
    for _ in 0..2000 {
        world.step(&command);
    }
    let first = sensors.read(&world);
    let (taxels, _) = first.of("touch").as_chunks::<3>();
    let weight: f64 = taxels.iter().map(|taxel| taxel[2]).sum();
    assert!((weight - 0.5 * G).abs() < 1e-6, "{weight}");
    // The servo gives way a little: in the tilted palm's frame the weight has a part along the surface.
    let force = taxels.iter().fold(Vec3::ZERO, |sum, [x, y, z]| sum + Vec3::new(*x, *y, -z));
    let force = world.state().base.rotation * force;
    assert!(force.x.abs() < 1e-6 && force.y.abs() < 1e-6, "{force:?}");
    let lit = taxels.iter().filter(|taxel| taxel[2] > 1e-3).count();
    assert!(lit >= 8, "four corners light more than one taxel each: {lit}");
    for _ in 0..1000 {
        world.step(&command);
        let now = sensors.read(&world);
        let change = |(a, b): (&[f64; 3], &[f64; 3])| (a[2] - b[2]).abs();
        let most = now.of("touch").as_chunks().0.iter().zip(taxels).map(change).fold(0.0, f64::max);
        assert!(most < 1e-6, "{most}");
    }
}

fn force_at_wrist(sensors: &Sensors, world: &World) -> [f64; 3] {
    sensors.read(world).column("wrist", "force").try_into().expect("three axes")
}

#[test]
fn the_wrist_carries_hand_and_block_at_rest_and_while_they_are_lifted() {
    let (hand, mut world, sensors) = palm_up();
    let mut command = stay(&hand);
    for _ in 0..2000 {
        world.step(&command);
    }
    let all = mass(&hand) + 0.5;
    let force = force_at_wrist(&sensors, &world);
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
            let force = force_at_wrist(&sensors, &world);
            let inertial = force[2] - all * G;
            assert!((inertial / (all * acceleration) - 1.0).abs() < 0.01, "at {t} s: {inertial}");
        }
    }
}

/// An accelerometer at rest reads the opposite of gravity, and while it is lifted the lifting as well.
#[test]
fn an_accelerometer_reads_weight_and_lifting() {
    let mut hand = Hand::clone(&Hand::builtin("reflex").expect("built in"));
    let link = hand.links[0].name.clone();
    hand.sensors.accelerometer = Some(Accelerometer { link, range: 40.0, noise: 0.0, bias: 0.0 });
    let hand = Arc::new(hand);
    let model = Arc::new(Model::new(Config::default(), Some(hand.clone())).expect("a model"));
    let turned = Rotation::from_scaled_axis(Vec3::X * 0.7);
    let state = State::at_rest(&model, Pose::from_rotation(turned), &[]);
    let mut world = World::new(model, state);
    let mut sensors = Sensors::new(hand.clone(), &world, TICK_S, None);
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
        sensors.tick(&world, tick as u64);
    }
    let read = Vec3::from_slice(sensors.read(&world).of("acceleration"));
    let expected = turned.inverse() * (Vec3::Z * (G + acceleration));
    assert!((read - expected).length() < 0.02, "{read:?} {expected:?}");
    // Beyond its range it reads the end of its range.
    let mut narrow = Hand::clone(&hand);
    narrow.sensors.accelerometer.as_mut().expect("it has one").range = 3.0;
    let mut sensors = Sensors::new(Arc::new(narrow), &world, TICK_S, None);
    sensors.tick(&world, 61);
    let readings = sensors.read(&world);
    let read = readings.of("acceleration");
    assert!(read.iter().all(|x| x.abs() <= 3.0) && read[2] == 3.0, "{read:?}");
}

/// A tendon's tension is the pull of its servo: stiffness times the wound length that the joints have not taken up.
#[test]
fn tension_is_the_pull_of_the_motor() {
    let (hand, mut world, sensors) = palm_up();
    let mut command = stay(&hand);
    command.sigma = vec![0.3, 0.4, 0.35, 0.2];
    for _ in 0..4000 {
        world.step(&command);
    }
    let state = world.state();
    for (tendon, k) in hand.tendons.iter().zip(0..) {
        let motor = tendon.motors[0].0;
        let taken: f64 = tendon.length(&state.q);
        let pull =
            tendon.stiffness * (tendon.wound(&hand.motors, |motor| state.motors[motor].position) - taken);
        let tension = sensors.read(&world).column("motors", "tension")[motor];
        let clamped = pull.clamp(tendon.least_force(), tendon.most_held());
        assert!((tension - clamped).abs() < 1e-6 * (1.0 + clamped.abs()), "{k}: {tension} {clamped}");
    }
}
