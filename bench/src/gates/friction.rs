//! Sliding and rolling.

use super::{converged, error, report};

#[test]
fn a_block_on_a_critical_slope_stays_and_on_a_steeper_one_slides() {
    let report = report("incline_critical", 1e-3);
    converged(&report);
    assert!(error(&report) <= 1.0, "{} %", error(&report));
    assert!(report.invariants.slip_mm_s.expect("creep is reported") <= 1e-6);
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    let report = report("slide_stop", 1e-3);
    converged(&report);
    assert!(error(&report) <= 1.0, "{} %", error(&report));
}

#[test]
fn a_rolling_cylinder_gains_no_energy() {
    let report = report("rolling_cylinder", 1e-3);
    converged(&report);
    let gain = report.invariants.energy_gain_j.expect("the gain is reported");
    // Of its 1.9e-4 J, some 3e-10 J come and go with the contact springs, which store 1.2e-6 J under its weight.
    assert!(gain <= 1e-9, "{gain:e} J");
    assert!(error(&report) <= 0.1, "{} %", error(&report));
}
