//! Cases that gate: what must hold, at every step length asked for. No timing is asserted here.
//! One file per subject, mirroring `cases/`.

mod balls;
mod consistency;
mod free_motion;
mod friction;
mod grasp;
mod hand_dynamics;
mod hard;
mod hold;
mod impact;
mod mechanism;
mod peers;
mod pile;
mod pinch;
mod random;
mod reflex;
mod robustness;
mod rolling;
mod stacking;
mod synergy;
mod tendon;

use crate::cases::{Setup, run};
use crate::engine::EngineKind;
use crate::report::Report;

/// Runs a case of ours without a reference run.
pub(crate) fn report(case: &str, dt_s: f64) -> Report {
    let setup = Setup::new(EngineKind::Own, dt_s);
    run(case, &setup).expect("the case runs").0
}

/// The figure of a case with an analytic answer.
pub(crate) fn error(report: &Report) -> f64 {
    report.error.value.expect("the case has an analytic answer")
}

/// What the case bounds kept to it.
pub(crate) fn within(report: &Report) {
    let most = report.error.within.expect("the case has a bound");
    assert!(error(report) <= most, "{} at {}: {} of {most}", report.case, report.dt_s, error(report));
}

/// Every step of the run converged and stayed finite.
pub(crate) fn converged(report: &Report) {
    assert_eq!(report.invariants.newton_unconverged, Some(0), "{}", report.case);
}

#[test]
fn unknown_names_are_refused_with_the_known_ones() {
    let setup = Setup::new(EngineKind::Own, 1e-3);
    let message = run("softhand_fre", &setup).err().expect("refused").to_string();
    assert!(message.contains("softhand_free"), "{message}");
    let message = EngineKind::from_names("other", None).expect_err("refused").to_string();
    assert!(message.contains("known engines: own, rapier, mujoco"), "{message}");
    let message = EngineKind::from_names("mujoco", Some("stiff")).expect_err("refused").to_string();
    assert!(message.contains("known settings: default, ") && message.contains("stiff5"), "{message}");
}
