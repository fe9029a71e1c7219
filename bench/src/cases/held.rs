//! Objects in or on a hand that should not move in it, and hands that should not fail.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid, velocity};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::random::Random;
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, HingeKind};
use palmares_models::read;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{BaseCommand, Config};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "shaken_grasp",
        "a block between two jaws, shaken by a target each 10 ms for a minute: creep",
        shaken_grasp,
    ),
    Case::ours(
        "roller_on_palm",
        "a cylinder and a capsule at rest on a level plate of the hand for a minute",
        roller_on_palm,
    ),
    Case::ours(
        "mimic_self_contact",
        "a light hand with a mimic joint whose fingers touch each other",
        mimic_self_contact,
    ),
];

/// Creep, µm, of a block of 0.3 kg in a minute between two jaws that press with 20 N (μ = 0.63) on a base
/// that moves up and down by 30 mm once a second, with a target each 10 ms. Friction holds 25 N, of which 4 N
/// are needed. Exact: 0.
pub fn shaken_grasp(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mu = 0.63;
    let jaw = |side: f64| Finger {
        kind: HingeKind::Prismatic,
        base_from_hinge: Pose::from_parts(
            Vec3::new(side * 0.04001, 0.0, 0.0),
            Rotation::from_rotation_y(-side * FRAC_PI_2),
        ),
        mass: 0.05,
        inertia: 5e-5,
        stiffness: 0.0,
        damping: 0.0,
        tension: 20.0,
        geoms: vec![Geom { link_from_geom: Pose::IDENTITY, shape: cuboid(0.06, 0.06, 0.02), friction: mu }],
    };
    let hand = Arc::new(fingers("jaws", Vec::new(), vec![jaw(-1.0), jaw(1.0)])?);
    let (mut engine, mut command) =
        SceneBuilder::with_hand(Config::with_step(setup.dt_s), hand, Pose::IDENTITY)?
            .body(cuboid(0.06, 0.06, 0.04), 0.3, mu, Pose::IDENTITY)?
            .start(setup)?;
    command.sigma.fill(1.0);
    recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
    let mut heights = [0.0; 2];
    let place = |state: &palmares_sim::State| (state.base.inverse() * state.objects[0]).translation.z;
    // Compared at the same place of the base's way.
    for (k, height) in heights.iter_mut().enumerate() {
        let seconds = if k == 0 { 1.0 } else { 60.0 };
        for step in 0..steps(seconds, setup.dt_s) {
            let t = (step as f64 * setup.dt_s / 0.01).floor() * 0.01;
            let z = 0.03 * libm::sin(TAU * t);
            command.base = BaseCommand::stay(Pose::translation(0.0, 0.0, z));
            recorder.step(&mut *engine, &command)?;
        }
        *height = place(engine.state());
    }
    Ok(recorder.finding(Figure::new("creep in a minute", (heights[1] - heights[0]).abs() * 1e6, "um")))
}

/// Displacement, µm, of a cylinder and a capsule on a level plate of the hand in a minute. Exact: 0.
pub fn roller_on_palm(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let plate = Geom {
        link_from_geom: Pose::translation(0.0, 0.0, -0.01),
        shape: cuboid(1.0, 1.0, 0.02),
        friction: 0.8,
    };
    let idle = Finger {
        kind: HingeKind::Prismatic,
        base_from_hinge: Pose::translation(0.0, 0.0, -0.5),
        mass: 0.01,
        inertia: 1e-5,
        stiffness: 10.0,
        damping: 1.0,
        tension: 1.0,
        geoms: Vec::new(),
    };
    let hand = Arc::new(fingers("plate", vec![plate], vec![idle])?);
    let lying = Rotation::from_rotation_x(FRAC_PI_2);
    let mut worst: f64 = 0.0;
    for shape in [
        Shape::Cylinder { radius: 0.008, half_length: 0.03 },
        Shape::Capsule { radius: 0.008, half_length: 0.03 },
    ] {
        let (mut engine, command) =
            SceneBuilder::with_hand(bolted(awake(setup.dt_s)), hand.clone(), Pose::IDENTITY)?
                .body(shape, 0.05, 0.8, Pose::from_parts(Vec3::new(0.0, 0.0, 0.008), lying))?
                .start(setup)?;
        recorder.steps(&mut *engine, &command, steps(60.0, setup.dt_s))?;
        let at = engine.state().objects[0].translation;
        worst = worst.max(at.x.abs().max(at.y.abs())).max(velocity(&*engine, 0).0.length());
    }
    Ok(recorder.finding(Figure::new("drift in a minute", worst * 1e6, "um")))
}

/// A hand of three moving links of 3 g, in which the second joint of one finger follows the first, and whose fingers meet.
const MIMIC: &str = include_str!("mimic.urdf");

/// Its motors.
const MIMIC_SETTINGS: &str = "name = \"mimic\"\ninertia = \"from_geometry\"\n\
    [motors.ml]\nscaling = 1.5\nspeed_limit = 2\n[motors.mr]\nscaling = 1.5\nspeed_limit = 2\n\
    [tendons.tl]\nstiffness = 100\ndamping = 0.05\nforce_limit = 0.5\nboth_ways = true\n\
    [tendons.tr]\nstiffness = 100\ndamping = 0.05\nforce_limit = 0.5\nboth_ways = true\n";

/// Worlds of ten that fail within 30 s of random commands, new ones each 0.4 s. Exact: none.
pub fn mimic_self_contact(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let files = (Path::new("mimic.urdf"), Path::new("hand.toml"));
    let settings = Some((files.1, MIMIC_SETTINGS));
    let hand = read::from_text((files.0, MIMIC), settings, None, &Default::default())?.hand;
    let hand = Arc::new(hand);
    let mut failed = 0;
    for seed in 1..=10 {
        let mut random = Random::new(seed);
        let (mut engine, mut command) =
            SceneBuilder::with_hand(Config::with_step(setup.dt_s), hand.clone(), Pose::IDENTITY)?
                .start(setup)?;
        for _ in 0..75 {
            let sigma = [random.between(0.0, 1.0), random.between(0.0, 1.0)];
            command.sigma.copy_from_slice(&sigma);
            recorder.steps(&mut *engine, &command, steps(0.4, setup.dt_s))?;
        }
        failed += u32::from(engine.world().is_none_or(|world| world.fault().is_some()));
    }
    Ok(recorder.finding(Figure::bounded("worlds that fail", f64::from(failed), "of 10", 0.0)))
}
