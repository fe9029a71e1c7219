//! The SoftHand alone: closing on air, against the closed form of adaptive synergies.

use super::case::{Case, Finding};
use super::scene::SceneBuilder;
use super::setup::{Setup, ends_of_steps, ramp, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::softhand;
use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::Push;
use palmares_sim::dynamics::jacobian::add_point_force;
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::equilibrium::ClosedForm;
use palmares_sim::{Command, Config};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "softhand_free",
        "SoftHand closes on air; joint error against the reference while it moves",
        free,
    ),
    Case::ours(
        "syn_free_close",
        "SoftHand closed on air at rest against the closed form of adaptive synergies",
        free_close,
    ),
    Case::ours(
        "syn_push_locked_motor",
        "closed SoftHand, motor locked, 1 N on the index fingertip, against the closed form",
        push_locked_motor,
    ),
];

/// Smallest distance between parts of a free hand, m.
const FREE_M: f64 = 5e-4;

/// A hand alone in the world.
pub(super) fn world_of(hand: Arc<Hand>, setup: &Setup) -> Result<(Box<dyn Engine>, Command)> {
    SceneBuilder::with_hand(Config::with_step(setup.dt_s), hand, Pose::IDENTITY)?.start(setup)
}

/// The largest σ at which the free hand is free: no joint within 0.02 rad of a limit, the tendon below its
/// limit, and no two parts of the hand that collide closer than half a millimetre.
fn free_sigma(hand: &Hand, form: &ClosedForm) -> f64 {
    let mut sigma: f64 = 1.0;
    while sigma > 0.01 {
        let s = hand.motors[0].wound(sigma);
        let (q, f) = form.solve(&[s], &vec![0.0; hand.coordinates.len()]);
        let inside = q.iter().zip(&hand.coordinates).all(|(q, c)| *q > c.lower + 0.02 && *q < c.upper - 0.02);
        let unsaturated = f.iter().zip(&hand.tendons).all(|(f, t)| *f < 0.95 * t.force_limit);
        let clear = hand.pairs_closer_than(FREE_M, &q).iter().all(|pair| hand.no_collision.contains(pair));
        if inside && unsaturated && clear {
            break;
        }
        sigma -= 0.01;
    }
    sigma
}

/// Runs the closing and returns the trace of q every 16 ms.
pub fn close_trace(setup: &Setup, recorder: &mut Recorder) -> Result<Vec<Vec<f64>>> {
    let hand = softhand()?;
    let sigma = free_sigma(&hand, &ClosedForm::new(&hand)?);
    let (mut world, mut command) = world_of(hand, setup)?;
    let every = steps(16e-3, setup.dt_s).max(1);
    let mut trace = Vec::new();
    for k in 0..steps(2.0, setup.dt_s) {
        let t = (k + 1) as f64 * setup.dt_s;
        command.sigma[0] = sigma * ramp(t / 1.0).0;
        recorder.step(&mut *world, &command)?;
        if (k + 1) % every == 0 {
            trace.push(world.state().q.clone());
        }
    }
    Ok(trace)
}

/// Largest joint error against the reference run while the free hand closes in 1 s and rests for 1 s.
pub fn free(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let trace = close_trace(setup, recorder)?;
    let error = setup.reference().and_then(|fine| {
        let reference = fine.once("softhand_free", |fine| close_trace(fine, &mut Recorder::default()));
        reference.ok().map(|reference| difference(&trace, &reference))
    });
    let error = Figure::from_own_fine_run("largest joint difference from its own fine run", error, "rad");
    Ok(recorder.finding(error))
}

/// Largest joint error at rest against `q = q₀ + C_s (s − R q₀)`.
pub fn free_close(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = softhand()?;
    let form = ClosedForm::new(&hand)?;
    let sigma = free_sigma(&hand, &form);
    let wound = hand.motors[0].wound(sigma);
    let (mut world, mut command) = world_of(hand, setup)?;
    for t in ends_of_steps(4.0, setup.dt_s) {
        command.sigma[0] = sigma * ramp(t).0;
        recorder.step(&mut *world, &command)?;
    }
    let (expected, _) = form.solve(&[wound], &vec![0.0; form.rest.len()]);
    let error = largest(&world.state().q, &expected);
    Ok(recorder.finding(Figure::new("largest joint error", error, "rad")))
}

/// Largest joint error at rest with 1 N on the index fingertip and the motor locked, against
/// `q = q₀ + C_s (s − R q₀) + D_s Jᵀ(q) w`, which is iterated to its fixed point.
pub fn push_locked_motor(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = softhand()?;
    let form = ClosedForm::new(&hand)?;
    let sigma = 0.7 * free_sigma(&hand, &form);
    let wound = hand.motors[0].wound(sigma);
    let link = hand
        .links
        .iter()
        .position(|link| link.name.contains("index_distal"))
        .context("the SoftHand has a link `index_distal`")?;
    let push = Push { link, point: Vec3::new(0.02, 0.0, 0.0), force: Vec3::new(-0.8, 0.0, -0.6) };
    let (mut world, mut command) = world_of(hand.clone(), setup)?;
    for t in ends_of_steps(6.0, setup.dt_s) {
        command.sigma[0] = sigma * ramp(t).0;
        command.pushes.clear();
        if t > 1.5 {
            command.pushes.push(push);
        }
        recorder.step(&mut *world, &command)?;
    }
    // The servo yields a little under the push: the pose of the base is read, the joints are predicted.
    let base = world.state().base;
    let n = hand.coordinates.len();
    let (mut expected, _) = form.solve(&[wound], &vec![0.0; n]);
    let mut kin = Kinematics::default();
    for _ in 0..200 {
        kin.update(&hand, base, &expected);
        let mut tau = vec![0.0; 6 + n];
        let at = kin.pose[link].transform_point(push.point);
        add_point_force(&hand, &kin, link, at, push.force, 1.0, &mut tau);
        expected = form.solve(&[wound], &tau[6..]).0;
    }
    let error = largest(&world.state().q, &expected);
    Ok(recorder.finding(Figure::new("largest joint error", error, "rad")))
}

/// Largest joint difference of two closings, rad.
pub fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| largest(a, b)).fold(0.0, f64::max)
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
