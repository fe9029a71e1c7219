//! Motors that reverse at once, with a carriage and with a closed chain.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, weightless};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use crate::rigs::bolted;
use anyhow::{Context, Result, ensure};
use palmares_models::Pose;
use palmares_models::hand::Hand;
use palmares_models::read;
use std::path::Path;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "sudden_reversals",
        "a drive pulls a carriage to and fro and reverses 40 times within a step: its place",
        sudden_reversals,
    ),
    Case::ours(
        "closed_chain",
        "the motor of a four-bar reverses 20 times: how far its pin opens",
        closed_chain,
    ),
];

/// A hand from URDF and TOML.
fn hand(urdf: &str, settings: &str) -> Result<Hand> {
    let settings = Some((Path::new("hand.toml"), settings));
    Ok(read::from_text((Path::new("hand.urdf"), urdf), settings, None, &Default::default())?.hand)
}

/// A carriage of 1 kg on a rail.
const CARRIAGE: &str = "<robot name='carriage'><link name='rail'><inertial><mass value='1'/>\
    <inertia ixx='1e-3' ixy='0' ixz='0' iyy='1e-3' iyz='0' izz='1e-3'/></inertial></link>\
    <link name='carriage'><inertial><mass value='1'/>\
    <inertia ixx='1e-3' ixy='0' ixz='0' iyy='1e-3' iyz='0' izz='1e-3'/></inertial></link>\
    <joint name='slide' type='prismatic'><parent link='rail'/><child link='carriage'/><axis xyz='1 0 0'/>\
    <limit lower='-5' upper='5' effort='1' velocity='1'/></joint></robot>";
/// Its drive pulls with 10 N, because its end is 100 m ahead.
const DRIVE: &str = "[motors.m]\nscaling = 200\noffset = 0.5\nspeed_limit = 1\n[tendons.drive]\njoints.slide = 1\nmotors.m = 1\n\
    both_ways = true\nstiffness = 1e4\nforce_limit = 10\n";
/// Acceleration of the carriage, m/s², and time from one reversal to the next, s, rounded to whole steps.
const ACCELERATION: f64 = 10.0;
const PULL_S: f64 = 0.05;

/// Largest distance of the carriage in 2 s from its exact place, mm: a chain of parabolas of 10 m/s², whose sign changes each 50 ms. Its
/// bound is the error of a method of first order.
pub fn sudden_reversals(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = hand(CARRIAGE, DRIVE)?;
    // From end to end within a step.
    hand.motors[0].speed_limit = 1e6;
    let (mut engine, mut command) =
        SceneBuilder::with_hand(bolted(weightless(setup.dt_s)), Arc::new(hand), Pose::IDENTITY)?
            .start(setup)?;
    let h = setup.dt_s;
    let pull = steps(PULL_S, h).max(1);
    // A method of first order is off by v h/2, v the largest speed; what is added is for rounding.
    let first_order = 0.5 * ACCELERATION * pull as f64 * h * h * (1.0 + 1e-6);
    let (mut place, mut speed, mut worst): (f64, f64, f64) = (engine.state().q[0], 0.0, 0.0);
    for k in 0..steps(2.0, h) {
        let forward = (k / pull).is_multiple_of(2);
        command.sigma[0] = if forward { 1.0 } else { 0.0 };
        recorder.step(&mut *engine, &command)?;
        let a = if forward { ACCELERATION } else { -ACCELERATION };
        place += speed * h + 0.5 * a * h * h;
        speed += a * h;
        worst = worst.max((engine.state().q[0] - place).abs());
    }
    let figure =
        Figure::bounded("largest distance from the exact place", worst * 1e3, "mm", first_order * 1e3);
    Ok(recorder.finding(figure))
}

/// Crank, coupler and rocker, closed by a pin of 1e7 N/m; a drive of at most 5 N·m turns the crank.
const FOUR_BAR: &str = include_str!("four_bar.urdf");
const FOUR_BAR_SETTINGS: &str = "[motors.m]\nscaling = 1.2\noffset = 0.5\nspeed_limit = 1\n\
    [tendons.drive]\njoints.crank = 1\nmotors.m = 1\nboth_ways = true\nstiffness = 40\nforce_limit = 5\n\
    [linkages.pin]\nlinks = ['coupler_link', 'rocker_link']\npoints = [[0.04, 0.01, 0], [0, 0.04, 0]]\nstiffness = 1e7\n";

/// Largest gap of the pin, mm, in 4 s in which the motor, at 1.2 rad/s, reverses each 0.2 s. Exact: 0.
pub fn closed_chain(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let hand = Arc::new(hand(FOUR_BAR, FOUR_BAR_SETTINGS)?);
    let (mut engine, mut command) =
        SceneBuilder::with_hand(bolted(weightless(setup.dt_s)), Arc::clone(&hand), Pose::IDENTITY)?
            .start(setup)?;
    engine.state_mut().motors[0].position = 0.5;
    let pin = hand.linkages.first().context("the chain is closed")?;
    let (mut gap, mut turned): (f64, f64) = (0.0, 0.0);
    for k in 0..steps(4.0, setup.dt_s) {
        let time = k as f64 * setup.dt_s;
        command.sigma[0] = if ((time / 0.2) as u64).is_multiple_of(2) { 1.0 } else { 0.0 };
        recorder.step(&mut *engine, &command)?;
        let q = &engine.state().q;
        gap = gap.max(pin.at(&hand, q).gap.length());
        turned = turned.max(q[0].abs());
    }
    ensure!(turned > 0.2, "the crank turned by {turned} rad only");
    Ok(recorder.finding(Figure::new("largest gap of the pin", gap * 1e3, "mm")))
}
