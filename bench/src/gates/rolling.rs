//! Rolling.

use super::{converged, error, report};

#[test]
fn a_rolling_cylinder_gains_no_energy() {
    let report = report("rolling_cylinder", 1e-3);
    converged(&report);
    let gain = report.invariants.energy_gain_j.expect("the gain is reported");
    // Of its 1.9e-4 J, some 3e-10 J come and go with the contact springs, which store 1.2e-6 J under its weight.
    assert!(gain <= 1e-9, "{gain:e} J");
    assert!(error(&report) <= 0.1, "{} %", error(&report));
}

#[test]
fn a_sphere_on_a_slope_rolls_or_slides_as_it_must() {
    // It rolls on the middle of the overlap, 25 µm nearer than its radius: 0.04 %.
    for dt in [1e-3, 8e-3] {
        let report = report("incline_sphere", dt);
        converged(&report);
        assert!(error(&report) <= 0.1, "at {dt}: {} %", error(&report));
    }
}
