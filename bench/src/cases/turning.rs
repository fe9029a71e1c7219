//! Objects on a palm that turns: stiction belongs to places, not to velocities.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid};
use super::setup::{Setup, ends_of_steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use crate::rigs::{bolted, fingers};
use anyhow::Result;
use palmares_models::hand::Geom;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::state::BaseReference;
use palmares_sim::{BaseCommand, Config};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "turning_palm",
        "a block rests on a level palm that turns to and fro for a minute",
        turning_palm,
    ),
    Case::ours(
        "turning_palm_servo",
        "the same on a palm that the servo of the base turns",
        turning_palm_servo,
    ),
    Case::ours(
        "turntable_limit",
        "a block on a turntable at 0.95 of the speed at which it slips",
        turntable_limit,
    ),
];

/// Distance of the block from the axis, m.
const RADIUS: f64 = 0.1;

/// Creep, µm, of a block of 0.1 kg in 59 s on a palm that turns by ±0.5 rad once a second. Its centripetal and tangential
/// acceleration need at most a fifth of the friction. Exact: 0.
pub fn turning_palm(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    creep(setup, recorder, bolted(awake(setup.dt_s)), (60.0, 1.0), |t| {
        let (sin, cos) = (TAU * t).sin_cos();
        (0.5 * sin, 0.5 * TAU * cos)
    })
}

/// The same, turned by the servo.
pub fn turning_palm_servo(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    creep(setup, recorder, awake(setup.dt_s), (60.0, 1.0), |t| {
        let (sin, cos) = (TAU * t).sin_cos();
        (0.5 * sin, 0.5 * TAU * cos)
    })
}

/// Creep, µm, in 9 s of a block on a table that turns at 4 rad/s, which it reaches within 0.9 s. Friction is 1/0.95 of what holds it
/// on its circle. Exact: 0.
pub fn turntable_limit(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (omega, up_s) = (4.0, 0.9);
    // While it gains speed, the tangential acceleration of 0.44 m/s² adds little to the centripetal one of 1.6 m/s².
    let mu = omega * omega * RADIUS / (0.95 * super::scene::G);
    creep(setup, recorder, bolted(awake(setup.dt_s)), (10.0, mu), |t| {
        let gained: f64 = (t / up_s).min(1.0);
        // The acceleration fades out, so that both together stay below the limit.
        let rate = omega * gained * (2.0 - gained);
        let angle = omega * up_s * gained * gained * (1.0 - gained / 3.0) + omega * (t - up_s).max(0.0);
        (angle, rate)
    })
}

/// Largest displacement of the block on the palm after the first second, µm.
fn creep(
    setup: &Setup,
    recorder: &mut Recorder,
    config: Config,
    (time_s, mu): (f64, f64),
    turn: impl Fn(f64) -> (f64, f64),
) -> Result<Finding> {
    let palm = Geom {
        link_from_geom: Pose::translation(0.0, 0.0, -0.01),
        shape: cuboid(0.4, 0.4, 0.02),
        friction: mu,
    };
    let hand = Arc::new(fingers("palm", vec![palm], Vec::new())?);
    let at = Pose::translation(RADIUS, 0.0, 0.005);
    let (mut engine, mut command) = SceneBuilder::with_hand(config, hand, Pose::IDENTITY)?
        .body(cuboid(0.03, 0.03, 0.01), 0.1, mu, at)?
        .start(setup)?;
    let on_palm = |state: &palmares_sim::State| state.base.inv_mul(&state.objects[0]).translation;
    let (mut from, mut most): (Option<Vec3>, f64) = (None, 0.0);
    for t in ends_of_steps(time_s, setup.dt_s) {
        let (angle, rate) = turn(t);
        command.base = BaseCommand::Exact(BaseReference {
            pose: Pose::from_parts(Vec3::ZERO, Rotation::from_rotation_z(angle)),
            linear: Vec3::ZERO,
            angular: Vec3::Z * rate,
        });
        recorder.step(&mut *engine, &command)?;
        // Springs yield to the same force at every whole second.
        if (t - t.round()).abs() < 0.5 * setup.dt_s && t >= 0.9 {
            let now = on_palm(engine.state());
            if from.is_none() {
                from = Some(now);
            }
            let aside = now - from.unwrap_or(now);
            most = most.max(aside.x.hypot(aside.y));
        }
    }
    Ok(recorder.finding(Figure::new("creep", 1e6 * most, "um")))
}
