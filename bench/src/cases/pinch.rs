//! The pinch hand: two fingers take a ball between their tips, close 0.5 s, lift 0.1 m in 1.5 s, hold 2 s.

use super::case::{Case, Finding};
use super::grasp::{static_residual, tension_balance};
use super::setup::{Setup, ends_of_steps, ramp, risen};
use crate::case_report::{Figure, Invariants};
use crate::recorder::Recorder;
use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State};
use std::f64::consts::PI;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[Case::ours(
    "pinch_ball",
    "the pinch hand closes on a 50 g ball, lifts and holds it between two fingertips",
    ball,
)];

/// Radius of the ball, m, and its mass, kg.
const RADIUS_M: f64 = 0.02;
const MASS_KG: f64 = 0.05;
/// Distance of the ball from the wrist flange, m: before the middle of the closed fingertips.
const ALONG_FINGERS_M: f64 = 0.122;
/// Set point of the closing motor, at which the tendon is at its limit. The curling motor stays open.
const CLOSED: f64 = 0.8;
const HOLD_FROM_S: f64 = 2.5;
const END_S: f64 = 4.5;

/// Speed of the ball against the palm while it is held still.
pub fn ball(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = Hand::builtin("pinch").context("the pinch hand is built in")?;
    let dt_s = setup.dt_s;
    let (model, state, start) = scene(&hand, Config::with_step(dt_s))?;
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), start);
    let in_palm = |state: &State| state.base.inverse_transform_point(state.objects[0].translation);
    let floor = world.state().objects[0].translation.z;
    let mut settled = Vec3::ZERO;
    for t in ends_of_steps(END_S, dt_s) {
        command.sigma[0] = CLOSED * ramp(t / 0.5).0;
        let (rise, rate) = ramp((t - 0.5) / 1.5);
        command.base = risen(start, 0.1 * rise, 0.1 * rate / 1.5);
        recorder.step(&mut *world, &command)?;
        if t >= HOLD_FROM_S - 1e-9 && t - dt_s < HOLD_FROM_S - 1e-9 {
            settled = in_palm(world.state());
        }
    }
    let slipped = (in_palm(world.state()) - settled).length();
    let lifted = world.state().objects[0].translation.z > floor + 0.05;
    let slip = slipped * 1e3 / (END_S - HOLD_FROM_S);
    let invariants = Invariants {
        held: Some(lifted && slipped < 0.01),
        slip_mm_s: Some(slip),
        hold_penetration_mm: Some(world.outcome().penetration_m * 1e3),
        static_residual_nm: world.world().map(static_residual),
        tension_balance_nm: world.world().map(tension_balance),
        ..recorder.invariants()
    };
    Ok(Finding { error: Figure::new("creep over 2 s", slip, "mm/s"), invariants })
}

/// The hand, fingers down, around the ball on a pedestal.
fn scene(hand: &Arc<Hand>, config: Config) -> Result<(Model, State, Pose)> {
    let mut model = Model::new(config, Some(Arc::clone(hand)))?;
    let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: RADIUS_M })];
    let pedestal = Shape::Box { half_extents: [0.01, 0.01, 0.02], rounding: 0.0 };
    model.add_static("pedestal", &pedestal, Pose::translation(0.0, 0.0, -RADIUS_M - 0.02 - 1e-5), 0.5)?;
    model.add_object(Arc::new(Object::new("ball", parts, MASS_KG, 0.8, 0.0)?))?;
    let base = Pose::from_parts(Vec3::new(0.0, 0.0, ALONG_FINGERS_M), Rotation::from_rotation_x(PI));
    let state = State::at_rest(&model, base, &[Pose::IDENTITY]);
    Ok((model, state, base))
}
