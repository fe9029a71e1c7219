//! Scenes that break simulators: light fingers against heavy objects, stiff cables and springs, commands that
//! jump, hands that start inside of things. Each reports the fastest speed and its bound: nothing explodes.

use super::case::{Case, Finding};
use super::grasp::{CHOSEN, Grasp, scene};
use super::scene::fastest;
use super::setup::{Setup, ends_of_steps, moved, ramp, risen};
use crate::case_report::{Figure, Invariants};
use crate::energy::Stored;
use crate::monitor::Monitor;
use crate::recorder::Recorder;
use crate::rigs::softhand;
use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::BaseCommand;
use palmares_sim::{Command, Config, Model, State};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("hard_heavy_object", "fingers of 24 g close on a 5 kg cylinder and lift it", heavy_object),
    Case::new(
        "hard_pressed_fingers",
        "a 5 kg ball falls on the open fingers of a hand that lies on the floor, which then close",
        pressed_fingers,
    ),
    Case::ours("hard_tendons", "grasps with cables of 50 to 1e6 N m/rad", tendons),
    Case::ours(
        "hard_springs",
        "a grasp with joint springs a hundred times stiffer and the cable as strong",
        springs,
    ),
    Case::new(
        "hard_pressed_base",
        "the base servo presses the hand against floor and wall with all its force",
        pressed_base,
    ),
    Case::new("hard_overlap", "the hand starts deep inside a ball; they are led apart", overlap),
    Case::ours(
        "hard_teleport",
        "the base's set point jumps by half a metre and a quarter turn while the hand holds an object",
        teleport,
    ),
    Case::ours(
        "hard_spin",
        "a capsule that spins at 100 rad/s about an oblique axis falls on the floor; energy from nowhere",
        spin,
    ),
    Case::ours("hard_flip", "the motor's command flips between 0 and 1 every 20 ms around an object", flip),
];

/// The measured course of a scene.
struct PlayResult {
    /// The fastest that an object or the base ever was, m/s.
    fastest_m_s: f64,
    /// The audit of energy; only our own engine has that of its forces.
    monitor: Option<Monitor>,
    invariants: Invariants,
    end: State,
}

/// Steps a scene under commands that depend on time, and monitors it.
fn play(
    setup: &Setup,
    recorder: &mut Recorder,
    (model, state): (Model, State),
    time_s: f64,
    mut command_at: impl FnMut(f64, &mut Command),
) -> Result<PlayResult> {
    let start = state.base;
    let mut engine = setup.start(model, state)?;
    let mut command = Command::stay(engine.model(), start);
    let mut monitor = engine.world().map(Monitor::new);
    let mut fastest_m_s: f64 = 0.0;
    for t in ends_of_steps(time_s, setup.dt_s) {
        command_at(t, &mut command);
        recorder.step(&mut *engine, &command)?;
        fastest_m_s = fastest_m_s.max(fastest(&*engine));
        if let Some((monitor, world)) = monitor.as_mut().zip(engine.world()) {
            monitor.step(world, &command);
        }
    }
    let invariants = monitor.as_ref().map_or_else(|| recorder.invariants(), Monitor::invariants);
    Ok(PlayResult { fastest_m_s, monitor, invariants, end: engine.state().clone() })
}

/// Nothing may become faster than the forces and heights of the scene allow.
fn finding(result: &PlayResult, held: Option<bool>, within_m_s: f64) -> Finding {
    Finding {
        error: Figure::bounded("fastest body", result.fastest_m_s, "m/s", within_m_s),
        invariants: Invariants { held, ..result.invariants },
    }
}

fn add_floor(model: &mut Model, top_m: f64) -> Result<()> {
    let slab = Shape::Box { half_extents: [3.0, 3.0, 0.1], rounding: 0.0 };
    Ok(model.add_static("floor", &slab, Pose::translation(0.0, 0.0, top_m - 0.1), 0.6)?)
}

/// Rises by 0.1 m from 0.8 s to 2 s.
fn lift(start: Pose, t: f64) -> BaseCommand {
    let (rise, rate) = ramp((t - 0.8) / 1.2);
    risen(start, 0.1 * rise, 0.1 * rate / 1.2)
}

/// A hand closes on an object on its pedestal and lifts it.
fn close_and_lift(
    setup: &Setup,
    recorder: &mut Recorder,
    hand: &Arc<Hand>,
    grasp: &Grasp,
) -> Result<(PlayResult, bool)> {
    let (mut model, state, start) = scene(hand, Config::with_step(setup.dt_s), grasp, CHOSEN)?;
    add_floor(&mut model, -0.3)?;
    let before = state.objects[0].translation.z;
    let result = play(setup, recorder, (model, state), 3.0, |t, command| {
        command.sigma[0] = ramp(t / 0.5).0;
        command.base = lift(start, t);
    })?;
    let lifted = result.end.objects[0].translation.z > before + 0.05;
    Ok((result, lifted))
}

/// The cylinder of the grasps at 5 kg. The hand need not be able to lift it; it may drop it from 0.4 m.
pub fn heavy_object(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let grasp = Grasp { mass: 5.0, ..Grasp::cylinder() };
    let (result, _) = close_and_lift(setup, recorder, &softhand()?, &grasp)?;
    Ok(finding(&result, None, 3.0))
}

/// The hand is palm up on the floor; the ball falls by 11 cm.
pub fn pressed_fingers(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut model = Model::new(Config::with_step(setup.dt_s), Some(softhand()?))?;
    // The palm's back reaches 4 cm behind the base frame.
    add_floor(&mut model, -0.045)?;
    let ball = Shape::Sphere { radius: 0.05 };
    model.add_object(Arc::new(
        Object::new("ball", vec![(Pose::IDENTITY, ball)], 5.0, 0.8, 1e-3)?.with_torsional_friction(1e-3)?,
    ))?;
    // Palm normal +x up: fingers +z point along −x of the world.
    let up = Pose::from_rotation(Rotation::from_rotation_y(-FRAC_PI_2));
    let over_fingers = up.transform_point(Vec3::new(0.17, 0.0, 0.22));
    let state = State::at_rest(&model, up, &[Pose::from_translation(over_fingers)]);
    let result = play(setup, recorder, (model, state), 2.0, |t, command| {
        command.sigma[0] = ramp((t - 0.8) / 0.5).0;
    })?;
    Ok(finding(&result, None, 1.55))
}

/// The worst of five cables.
pub fn tendons(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: Option<PlayResult> = None;
    let mut held = true;
    for stiffness in [50.0, 1e3, 1e4, 1e5, 1e6] {
        let mut hand = Hand::clone(&*softhand()?);
        hand.tendons[0].stiffness = stiffness;
        let (result, lifted) = close_and_lift(setup, recorder, &Arc::new(hand), &Grasp::cylinder())?;
        held &= lifted;
        if worst.as_ref().is_none_or(|worst| result.fastest_m_s > worst.fastest_m_s) {
            worst = Some(result);
        }
    }
    let mut worst = worst.context("there are cables")?;
    worst.invariants.newton_unconverged = recorder.invariants().newton_unconverged;
    Ok(finding(&worst, Some(held), 1.0))
}

/// Springs of 60 to 100 N m/rad, a cable of 200 N m, which closes on 0.1 kg; a thrown object falls 0.3 m.
pub fn springs(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = Hand::clone(&*softhand()?);
    for c in &mut hand.coordinates {
        c.stiffness *= 100.0;
    }
    hand.tendons[0].force_limit *= 100.0;
    hand.tendons[0].stiffness *= 100.0;
    let (result, held) = close_and_lift(setup, recorder, &Arc::new(hand), &Grasp::cylinder())?;
    Ok(finding(&result, Some(held), 6.0))
}

/// Fingers down, the set point goes 15 cm under the floor, then 20 cm into a wall, the hand closing meanwhile.
pub fn pressed_base(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut model = Model::new(Config::with_step(setup.dt_s), Some(softhand()?))?;
    add_floor(&mut model, 0.0)?;
    let slab = Shape::Box { half_extents: [1.0, 1.0, 0.1], rounding: 0.0 };
    let upright = Rotation::from_rotation_y(FRAC_PI_2);
    model.add_static("wall", &slab, Pose::from_parts(Vec3::new(0.3, 0.0, 0.0), upright), 0.6)?;
    let top = Pose::from_parts(Vec3::new(0.0, 0.0, 0.32), Rotation::from_rotation_y(PI));
    let state = State::at_rest(&model, top, &[]);
    let result = play(setup, recorder, (model, state), 3.0, |t, command| {
        let at = if t < 1.2 { Vec3::new(0.0, 0.0, -0.15) } else { Vec3::new(0.4, 0.0, 0.1) };
        command.base = BaseCommand::stay(Pose::from_parts(at, top.rotation));
        command.sigma[0] = if t < 2.0 { 0.0 } else { 1.0 };
    })?;
    // Wrist and palm must not have gone through.
    let at = result.end.base.translation;
    Ok(finding(&result, Some(at.z >= 0.0 && at.x <= 0.2), 10.0))
}

/// A ball of 5 cm radius and 0.5 kg whose surface reaches 3 cm into the palm and the roots of the fingers.
pub fn overlap(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let config = Config { gravity: Vec3::ZERO, ..Config::with_step(setup.dt_s) };
    let mut model = Model::new(config, Some(softhand()?))?;
    let ball = Shape::Sphere { radius: 0.05 };
    model.add_object(Arc::new(
        Object::new("ball", vec![(Pose::IDENTITY, ball)], 0.5, 0.8, 1e-3)?.with_torsional_friction(1e-3)?,
    ))?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.033, 0.0, 0.16)]);
    let result = play(setup, recorder, (model, state), 2.0, |_, _| {})?;
    let separated = result.end.objects[0].translation.x > 0.05;
    Ok(finding(&result, Some(separated), 1.0))
}

/// The set point jumps there and back, each time for 0.4 s, past all limits of speed. 500 N an axis over 0.5 m on 0.7 kg:
/// 27 m/s.
pub fn teleport(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let config = Config::with_step(setup.dt_s);
    let (mut model, state, start) = scene(&softhand()?, config, &Grasp::cylinder(), CHOSEN)?;
    add_floor(&mut model, -0.3)?;
    let turned = Rotation::from_rotation_x(FRAC_PI_2) * start.rotation;
    let far = Pose::from_parts(start.translation + Vec3::new(0.3, 0.3, 0.3), turned);
    let result = play(setup, recorder, (model, state), 3.0, |t, command| {
        command.sigma[0] = ramp(t / 0.5).0;
        let there = t > 0.8 && (((t - 0.8) / 0.4) as u64).is_multiple_of(2);
        command.base = moved(if there { far } else { start }, Vec3::ZERO, Vec3::ZERO);
    })?;
    Ok(finding(&result, None, 27.0))
}

/// The motor itself is made fast enough to follow.
pub fn flip(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = Hand::clone(&*softhand()?);
    hand.motors[0].speed_limit = 1e3;
    let config = Config::with_step(setup.dt_s);
    let (mut model, state, _) = scene(&Arc::new(hand), config, &Grasp::cylinder(), CHOSEN)?;
    add_floor(&mut model, -0.3)?;
    let result = play(setup, recorder, (model, state), 3.0, |t, command| {
        command.sigma[0] = if ((t / 0.02) as u64).is_multiple_of(2) { 1.0 } else { 0.0 };
    })?;
    Ok(finding(&result, None, 5.0))
}

/// Falls 5 mm and tumbles for 3 s. It has 2 J of rotation at the start; contact may take energy, never add.
/// The figure is the energy from nowhere in percent of the energy at the start.
pub fn spin(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut model = Model::new(Config::with_step(setup.dt_s), None)?;
    add_floor(&mut model, 0.0)?;
    let capsule = Shape::Capsule { radius: 0.025, half_length: 0.03 };
    model.add_object(Arc::new(Object::new("capsule", vec![(Pose::IDENTITY, capsule)], 0.85, 0.6, 0.0)?))?;
    let leaning = Rotation::from_rotation_x(0.5);
    let at = Vec3::new(0.0, 0.0, 0.025 + 0.03 * 0.5f64.cos() + 0.005);
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[Pose::from_parts(at, leaning)]);
    state.v[3..].copy_from_slice(&[30.0, 20.0, 95.0]);
    let kinetic = Stored::of(&model, &state).kinetic;
    let result = play(setup, recorder, (model, state), 3.0, |_, _| {})?;
    let monitor = result.monitor.context("only our own engine keeps books of its forces")?;
    Ok(Finding {
        error: Figure::new("energy from nowhere", 100.0 * monitor.excess_j / kinetic, "%"),
        invariants: monitor.invariants(),
    })
}
