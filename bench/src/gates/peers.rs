//! The engines we are compared with simulate the same scenes.

use crate::cases::{Setup, run};
use crate::engine::EngineKind;

/// The free hand closes to the closed form in rapier too: same tree, springs, couplings and tendon.
#[test]
fn rapier_closes_the_hand_to_the_closed_form() {
    let setup = Setup { engine: EngineKind::Rapier, dt_s: 4e-3, reference_dt_s: None };
    let (report, _) = run("syn_free_close", &setup).expect("the case runs");
    let error = report.error.value.expect("the case has an analytic answer");
    assert!(error <= 1e-3, "{error:e} rad");
}

#[test]
fn rapier_stops_a_sliding_cube_near_where_coulomb_says() {
    let setup = Setup { engine: EngineKind::Rapier, dt_s: 1e-3, reference_dt_s: None };
    let (report, _) = run("slide_stop", &setup).expect("the case runs");
    let error = report.error.value.expect("the case has an analytic answer");
    assert!(error <= 1.0, "{error} %");
}
