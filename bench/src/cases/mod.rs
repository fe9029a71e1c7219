//! The cases, by name.

pub mod arch;
pub mod balls;
pub mod blows;
pub mod calibration;
mod case;
pub mod consistency;
pub mod dead;
pub mod dry;
mod elliptic;
pub mod extremes;
pub mod faces;
pub mod free_motion;
pub mod friction;
pub mod grasp;
pub mod grasp_scene;
pub mod gripper;
pub mod hand_dynamics;
pub mod hard;
pub mod heaps;
pub mod held;
pub mod hold;
pub mod impact;
pub mod instrument;
pub mod mechanism;
pub mod passing;
pub mod pile;
pub mod pinch;
pub mod placed;
pub mod pour;
pub mod random_heap;
pub mod reflex;
pub mod residuals;
pub mod reversing;
pub mod rims;
pub mod robustness;
pub mod rocking;
pub mod rolling;
pub mod rubbing;
pub(crate) mod scene;
mod setup;
pub mod sleeping;
pub mod spinning;
pub mod stacking;
pub mod synergy;
pub mod tendon;
pub mod thin;
pub mod ties;
pub mod torsion;
pub mod turning;

pub use case::{Case, Finding};
pub use setup::{ASIDE_M, Setup, ends_of_steps, moved, ramp, risen, steps};

use crate::case_report::CaseReport;
use crate::recorder::Recorder;
use anyhow::{Result, bail};

/// Every case, by subject.
pub const GROUPS: &[&[Case]] = &[
    synergy::CASES,
    grasp::CASES,
    pinch::CASES,
    gripper::CASES,
    reflex::CASES,
    balls::CASES,
    pile::CASES,
    pour::CASES,
    hand_dynamics::CASES,
    tendon::CASES,
    rubbing::CASES,
    hold::CASES,
    calibration::CASES,
    hard::CASES,
    consistency::CASES,
    friction::CASES,
    free_motion::CASES,
    rolling::CASES,
    stacking::CASES,
    mechanism::CASES,
    rims::CASES,
    robustness::CASES,
    residuals::CASES,
    impact::CASES,
    heaps::CASES,
    torsion::CASES,
    faces::CASES,
    thin::CASES,
    held::CASES,
    blows::CASES,
    dead::CASES,
    dry::CASES,
    placed::CASES,
    spinning::CASES,
    ties::CASES,
    sleeping::CASES,
    turning::CASES,
    passing::CASES,
    arch::CASES,
    extremes::CASES,
    reversing::CASES,
    rocking::CASES,
];

/// Every case.
pub fn all() -> impl Iterator<Item = &'static Case> {
    GROUPS.iter().copied().flatten()
}

/// Runs one case.
pub fn run(name: &str, setup: &Setup) -> Result<(CaseReport, Recorder)> {
    let Some(case) = all().find(|case| case.name == name) else {
        let names: Vec<&str> = all().map(|case| case.name).collect();
        bail!("unknown case `{name}`; known cases: {}", names.join(", "));
    };
    if !(setup.dt_s > 0.0 && setup.dt_s <= 0.1) {
        bail!("step {} s is out of range; it must be positive and at most 0.1 s", setup.dt_s);
    }
    let mut recorder = Recorder::default();
    let finding = (case.run)(setup, &mut recorder)?;
    let report = CaseReport {
        case: name.to_owned(),
        engine: setup.engine.name().to_owned(),
        settings: setup.engine.settings().to_owned(),
        dt_s: setup.dt_s,
        rtf: recorder.rtf(setup.dt_s),
        us_per_step: recorder.times(),
        error: finding.error,
        measured: std::mem::take(&mut recorder.measured),
        invariants: finding.invariants,
    };
    Ok((report, recorder))
}
