//! A level palm that turns: what friction holds rides along.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, set_velocity};
use super::setup::{Setup, ends_of_steps, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, Hand, HingeKind};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::state::BaseReference;
use palmares_sim::{BaseCommand, Command, Config};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "turning_palm",
        "block on a palm that turns to and fro, bolted: creep in a minute",
        turning_palm,
    ),
    Case::ours("turning_palm_servo", "the same with the base on its servo", turning_palm_servo),
    Case::ours("turntable", "block on a table that turns at 0.95 of the limit of friction", turntable),
    Case::ours("turning_grip", "box gripped on a palm that turns to and fro: creep", turning_grip),
];

/// A block of 30 x 30 x 10 mm and 0.1 kg.
const BLOCK_M: [f64; 3] = [0.03, 0.03, 0.01];
const BLOCK_KG: f64 = 0.1;

/// A base that turns about z, at 0 in the origin: angle, rad, and rate, rad/s.
fn turned((angle, rate): (f64, f64)) -> BaseCommand {
    let pose = Pose::from_rotation(Rotation::from_rotation_z(angle));
    BaseCommand::Exact(BaseReference { pose, linear: Vec3::ZERO, angular: Vec3::Z * rate })
}

/// To and fro once a second by an angle on both sides of its middle, from rest at one end.
fn to_and_fro(most: f64) -> impl Fn(f64) -> (f64, f64) {
    move |t| (most * ((TAU * t).cos() - 1.0), -most * TAU * (TAU * t).sin())
}

/// A finger that touches nothing: a hand has one.
fn idle() -> Finger {
    Finger {
        kind: HingeKind::Prismatic,
        base_from_hinge: Pose::IDENTITY,
        mass: 0.05,
        inertia: 1e-5,
        stiffness: 100.0,
        damping: 1.0,
        tension: 0.0,
        geoms: Vec::new(),
    }
}

/// A disc whose top is z = 0.
fn palm(friction: f64) -> Geom {
    Geom {
        link_from_geom: Pose::translation(0.0, 0.0, -0.01),
        shape: Shape::Cylinder { radius: 0.4, half_length: 0.01 },
        friction,
    }
}

/// Place of the first object in the base's frame.
fn in_palm(engine: &dyn Engine) -> Vec3 {
    let state = engine.state();
    state.base.inverse().transform_point(state.objects[0].translation)
}

fn palm_with_block(
    setup: &Setup,
    config: Config,
    radius: f64,
    friction: f64,
) -> Result<(Box<dyn Engine>, Command)> {
    let hand: Arc<Hand> = Arc::new(fingers("palm", vec![palm(friction)], vec![idle()])?);
    let [x, y, z] = BLOCK_M;
    SceneBuilder::with_hand(config, hand, Pose::IDENTITY)?
        .body(cuboid(x, y, z), BLOCK_KG, friction, Pose::translation(radius, 0.0, 0.5 * z))?
        .start(setup)
}

/// Distance, µm, by which a block (μ = 1), 0.1 m from the axis of a palm that turns by ±0.5 rad once a second, is elsewhere on
/// the palm a minute later. It needs a fifth of its friction. Exact: 0, since a whole number of turns lies between.
pub fn turning_palm(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    turn_palm(setup, recorder, bolted(awake(setup.dt_s)))
}

/// The same with the base on its servo.
pub fn turning_palm_servo(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    turn_palm(setup, recorder, awake(setup.dt_s))
}

fn turn_palm(setup: &Setup, recorder: &mut Recorder, config: Config) -> Result<Finding> {
    let (mut engine, command) = palm_with_block(setup, config, 0.1, 1.0)?;
    let creep = creep_of(&mut *engine, command, recorder, to_and_fro(0.5), 60.0)?;
    Ok(recorder.finding(Figure::new("creep in a minute", creep * 1e6, "um")))
}

/// Turns the base for a second, and then for `time_s`: the way of the first object on the palm in that time, m.
fn creep_of(
    engine: &mut dyn Engine,
    mut command: Command,
    recorder: &mut Recorder,
    course: impl Fn(f64) -> (f64, f64),
    time_s: f64,
) -> Result<f64> {
    let step_s = engine.model().config().step_s;
    let mut before = Vec3::ZERO;
    // A whole number of steps after which the course is as in the beginning: a second is no multiple of every step.
    let settled = steps(1.0, step_s);
    let mut farthest: f64 = 0.0;
    let per_second = |k: u64| (k as f64 * step_s - (k as f64 * step_s).round()).abs() < 0.01 * step_s;
    for (k, t) in (1..).zip(ends_of_steps(1.0 + time_s, step_s)) {
        command.base = turned(course(t));
        recorder.step(engine, &command)?;
        if k == settled {
            before = in_palm(engine);
        } else if k > settled && per_second(k) {
            farthest = farthest.max(in_palm(engine).distance(before));
        }
    }
    Ok(farthest)
}

/// Distance, mm, by which a block (μ = 0.4) moves on a table that turns at 4 rad/s, where it needs 0.95 of its friction, in 4 s
/// after the first. Exact: 0.
pub fn turntable(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (rate, friction) = (4.0, 0.4);
    let radius = 0.95 * friction * G / (rate * rate);
    let (mut engine, command) = palm_with_block(setup, bolted(awake(setup.dt_s)), radius, friction)?;
    engine.state_mut().v[5] = rate;
    set_velocity(&mut *engine, 0, Vec3::Y * (rate * radius), Vec3::Z * rate);
    let course = |t: f64| (rate * t, rate);
    let creep = creep_of(&mut *engine, command, recorder, course, 4.0)?;
    Ok(recorder.finding(Figure::new("creep in 4 s", creep * 1e3, "mm")))
}

/// Creep, mm, in 5 s of a box (0.1 kg, 30 mm) that a finger presses with 10 N against a wall of the palm on which it stands, the
/// palm turning by ±0.2 rad once a second. Exact: 0.
pub fn turning_grip(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (edge, thick, friction) = (0.03, 0.005, 0.8);
    let upright = Rotation::from_rotation_x(FRAC_PI_2);
    let wall = Geom {
        link_from_geom: Pose::translation(0.1, -0.5 * edge - thick, 0.5 * edge),
        shape: cuboid(edge, 2.0 * thick, edge),
        friction,
    };
    let finger = Finger {
        // Its joint pulls along −y: no plate is in the way of what drifts outward.
        base_from_hinge: Pose::from_parts(Vec3::new(0.1, 0.5 * edge + thick, 0.5 * edge), upright),
        tension: 10.0,
        stiffness: 0.0,
        geoms: vec![Geom {
            link_from_geom: Pose::IDENTITY,
            shape: cuboid(edge, edge, 2.0 * thick),
            friction,
        }],
        ..idle()
    };
    let hand = fingers("grip", vec![palm(friction), wall], vec![finger])?;
    let place = Pose::translation(0.1, 0.0, 0.5 * edge);
    let (mut engine, mut command) =
        SceneBuilder::with_hand(bolted(awake(setup.dt_s)), Arc::new(hand), Pose::IDENTITY)?
            .body(cuboid(edge, edge, edge), 0.1, friction, place)?
            .start(setup)?;
    command.sigma[0] = 1.0;
    let creep = creep_of(&mut *engine, command, recorder, to_and_fro(0.2), 5.0)?;
    Ok(recorder.finding(Figure::new("creep in 5 s", creep * 1e3, "mm")))
}
