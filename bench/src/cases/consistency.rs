//! The order with which scenes converge to their own finer runs.

use super::case::{Case, Finding};
use super::grasp::{Grasp, difference};
use super::setup::Setup;
use super::synergy;
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "self_consistency",
        "SoftHand closing on air against its own run at dt/64: order between dt and dt/4",
        free,
    ),
    Case::new(
        "self_consistency_grasp",
        "SoftHand grasping cylinder and box against its own run at dt/16: largest object error",
        grasp,
    ),
];

/// `log₄` of the ratio of the joint errors at dt and at dt/4, both against dt/64.
pub fn free(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let at = |divisor: f64| Setup { dt_s: setup.dt_s / divisor, ..*setup };
    let reference = synergy::close_trace(&at(64.0), &mut Recorder::default())?;
    let error = |setup: &Setup, recorder: &mut Recorder| {
        synergy::close_trace(setup, recorder).map(|trace| synergy::difference(&trace, &reference))
    };
    let (coarse, fine) = (error(setup, recorder)?, error(&at(4.0), &mut Recorder::default())?);
    Ok(recorder.finding(Figure::new("order of convergence", (coarse / fine).log2() / 2.0, "")))
}

/// Largest distance of the object's centre in the palm between dt and dt/16 until the end of the hold, over both
/// grasps. Impacts of fingers amplify differences: no order is to be expected, but a bound.
pub fn grasp(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let fine = Setup { dt_s: setup.dt_s / 16.0, ..*setup };
    let mut worst: f64 = 0.0;
    for grasp in [Grasp::cylinder(), Grasp::cuboid()] {
        worst = worst.max(difference(setup, &fine, &grasp, recorder)?);
    }
    Ok(recorder.finding(Figure::new("largest object error", worst * 1e3, "mm")))
}
