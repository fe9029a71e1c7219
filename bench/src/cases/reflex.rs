//! The ReFlex: closing on air against the exact equilibrium of R(q), and a grasp from above.

use super::case::{Case, Finding};
use super::grasp::{static_residual, tension_balance};
use super::setup::{Setup, ends_of_steps, ramp, risen};
use super::synergy::world_of;
use crate::case_report::{Figure, Invariants};
use crate::recorder::Recorder;
use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
#[cfg(test)]
use palmares_sim::World;
use palmares_sim::statics::equilibrium::solve_free;
use palmares_sim::{Command, Config, Model, State};
use std::f64::consts::PI;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours("reflex_free", "ReFlex closed on air at rest against the exact equilibrium of its R(q)", free),
    Case::ours(
        "reflex_ball",
        "ReFlex closes on a 1 kg ball of 10 cm from above, lifts it and holds it for 2 s",
        ball,
    ),
];

fn reflex() -> Result<Arc<Hand>> {
    Hand::builtin("reflex").context("the ReFlex is built in")
}

/// Largest joint error at rest over three closings, against `E (q − q₀) = R(q)ᵀ f`.
pub fn free(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = reflex()?;
    let mut worst: f64 = 0.0;
    for closed in [0.3, 0.6, 0.9] {
        let (mut world, mut command) = world_of(Arc::clone(&hand), setup)?;
        for t in ends_of_steps(6.0, setup.dt_s) {
            command.sigma[..3].fill(closed * ramp(t).0);
            recorder.step(&mut *world, &command)?;
        }
        let s: Vec<f64> =
            hand.tendons.iter().map(|t| t.wound(&hand.motors, |motor| command.sigma[motor])).collect();
        let open: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
        let expected = solve_free(&hand, &s, &vec![0.0; open.len()], &open)?;
        for (q, expected) in world.state().q.iter().zip(&expected.q) {
            worst = worst.max((q - expected).abs());
        }
    }
    Ok(recorder.finding(Figure::new("largest joint error", worst, "rad")))
}

/// Radius of the ball, m.
const RADIUS_M: f64 = 0.05;

/// Position of the ball's centre in the hand's frame before closing, and set points of the motors.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// From the palm's frame towards fingers 1 and 2, m.
    pub x_m: f64,
    /// From the bottom of the housing, m.
    pub z_m: f64,
    /// Set point of the preshape drive.
    pub preshape: f64,
    /// Set point of the fingers' motors.
    pub sigma: f64,
}

/// The placement of the case: midway between the fingers' bases, clear of the palm, fingers 1 and 2 turned by 36°.
pub const CHOSEN: Placement = Placement { x_m: 0.015, z_m: 0.15, preshape: 0.4, sigma: 0.9 };

/// Preshape until 1 s, close until 2.2 s, lift by 0.1 m until 3.2 s, hold.
const CLOSE_S: f64 = 1.0;
const LIFT_S: f64 = 2.2;
/// From this time on the ball must not move in the hand, s.
const SETTLED_S: f64 = 3.7;
const END_S: f64 = 5.7;

/// Drift of the ball in the hand over the 2 s of the hold.
pub fn ball(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let invariants = play(setup, CHOSEN, recorder)?;
    let slip = invariants.slip_mm_s.context("a hold reports its slip")?;
    Ok(Finding { error: Figure::new("creep over 2 s", slip, "mm/s"), invariants })
}

/// The hand palm down over the ball, on a post at the world's origin.
fn scene(dt_s: f64, placement: Placement) -> Result<(Model, State, Pose)> {
    let hand = reflex()?;
    let mut model = Model::new(Config::with_step(dt_s), Some(hand))?;
    let sphere = Shape::Sphere { radius: RADIUS_M };
    let ball = Object::new("ball", vec![(Pose::IDENTITY, sphere)], 1.0, 0.5, 0.0)?;
    let post = Shape::Box { half_extents: [0.02, 0.02, 0.02], rounding: 0.0 };
    model.add_static("post", &post, Pose::translation(0.0, 0.0, -RADIUS_M - 0.02 - 1e-5), 0.5)?;
    model.add_object(Arc::new(ball))?;
    let down = Rotation::from_rotation_x(PI);
    let start = Pose::from_parts(-(down * Vec3::new(placement.x_m, 0.0, placement.z_m)), down);
    let state = State::at_rest(&model, start, &[Pose::IDENTITY]);
    Ok((model, state, start))
}

/// Sets the command for the step that ends at time t.
fn instruct(command: &mut Command, placement: Placement, start: Pose, t: f64) {
    command.sigma[..3].fill(placement.sigma * ramp(t - CLOSE_S).0);
    command.sigma[3] = placement.preshape * ramp(t / CLOSE_S).0;
    let (rise, rate) = ramp(t - LIFT_S);
    command.base = risen(start, 0.1 * rise, 0.1 * rate);
}

/// One grasp of the ball.
pub fn play(setup: &Setup, placement: Placement, recorder: &mut Recorder) -> Result<Invariants> {
    let dt_s = setup.dt_s;
    let (model, state, start) = scene(dt_s, placement)?;
    let mut command = Command::stay(&model, start);
    let mut world = setup.start(model, state)?;
    let (mut settled, mut held) = (Vec3::ZERO, Vec3::ZERO);
    for t in ends_of_steps(END_S, dt_s) {
        instruct(&mut command, placement, start, t);
        recorder.step(&mut *world, &command)?;
        held = world.state().base.inverse_transform_point(world.state().objects[0].translation);
        if t >= SETTLED_S - 1e-9 && t - dt_s < SETTLED_S - 1e-9 {
            settled = held;
        }
    }
    let lifted = world.state().objects[0].translation.z > 0.05;
    Ok(Invariants {
        held: Some(lifted && (held - settled).length() < 5e-3),
        slip_mm_s: Some((held - settled).length() * 1e3 / (END_S - SETTLED_S)),
        static_residual_nm: world.world().map(static_residual),
        tension_balance_nm: world.world().map(tension_balance),
        hold_penetration_mm: Some(world.outcome().penetration_m * 1e3),
        ..recorder.invariants()
    })
}

/// The ball grasp after `time_s` of its path, and the command that continues it.
#[cfg(test)]
pub(crate) fn grasping(time_s: f64) -> (World, Command) {
    let dt_s = 1e-3;
    let (model, state, start) = scene(dt_s, CHOSEN).expect("the scene is sound");
    let mut command = Command::stay(&model, start);
    let mut world = World::new(Arc::new(model), state);
    for t in ends_of_steps(time_s, dt_s) {
        instruct(&mut command, CHOSEN, start, t);
        world.step(&command);
    }
    (world, command)
}
