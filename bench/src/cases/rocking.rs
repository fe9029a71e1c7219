//! A block that rocks from one edge to the other.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::{Result, bail};
use palmares_models::{Pose, Rotation, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[Case::new(
    "rocking_block",
    "a block rocks from edge to edge: the angular velocity that an impact leaves",
    rocking_block,
)];

/// Width and height of the block, m.
const SIDES_M: [f64; 2] = [0.04, 0.12];

/// Impacts of a play.
const IMPACTS: usize = 3;

/// Largest error, %, of the angular velocity that an impact leaves, as a part of that before, over the first three impacts
/// of a block (40 x 100 x 120 mm, 0.2 kg, μ = 0.8) that starts on one edge at 0.6 and at 0.5 α. Exact: `r = 1 − 3/2 sin² α`
/// (Housner 1963, *The behavior of inverted pendulum structures during earthquakes*), α from the vertical to the diagonal.
/// Between two turning points at θ the energy `cos(α − |θ|) − cos α` falls by r².
pub fn rocking_block(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let alpha = libm::atan2(SIDES_M[0], SIDES_M[1]);
    let housner = 1.0 - 1.5 * libm::sin(alpha).powi(2);
    let energy = |angle: f64| libm::cos(alpha - angle.abs()) - libm::cos(alpha);
    let mut worst: f64 = 0.0;
    for part in [0.6, 0.5] {
        let mut before = part * alpha;
        for after in turning_points(setup, recorder, before)? {
            let kept = (energy(after) / energy(before)).sqrt();
            worst = worst.max((kept / housner - 1.0).abs());
            before = after;
        }
    }
    Ok(recorder.finding(Figure::new("error of the velocity after an impact", 100.0 * worst, "%")))
}

/// Angles, rad, at which the block turns back.
fn turning_points(setup: &Setup, recorder: &mut Recorder, start: f64) -> Result<[f64; IMPACTS]> {
    let turn = Rotation::from_rotation_y(start);
    let edge = turn * Vec3::new(0.5 * SIDES_M[0], 0.0, -0.5 * SIDES_M[1]);
    let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
        .ground(0.8)
        .body(cuboid(SIDES_M[0], 0.1, SIDES_M[1]), 0.2, 0.8, Pose::from_parts(-edge, turn))?
        .start(setup)?;
    let (mut found, mut count, mut omega) = ([0.0; IMPACTS], 0, 0.0);
    for _ in 0..steps(1.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let (rotation, now) = (engine.state().objects[0].rotation, engine.state().v[4]);
        if now * omega < 0.0 {
            found[count] = 2.0 * libm::atan2(rotation.y, rotation.w);
            count += 1;
            if count == IMPACTS {
                return Ok(found);
            }
        }
        omega = now;
    }
    bail!("it turned back {count} times in a second instead of {IMPACTS}")
}
