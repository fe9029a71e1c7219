//! Free bodies.

use super::{converged, error, report};

#[test]
fn a_thrown_box_flies_the_parabola() {
    for dt in [0.25e-3, 1e-3, 16e-3] {
        let report = report("free_flight", dt);
        converged(&report);
        // 400 m in up to 40,000 rounded sums; the best published figure at 1 ms is 24.5 mm.
        assert!(error(&report) <= 1e-6, "at {dt}: {:e} mm", error(&report));
    }
}

#[test]
fn a_tumbling_box_keeps_its_angular_momentum_and_energy() {
    // L is kept but for rounding, E to the fourth order in h. Published at 1 ms: 6.4e-3 and 6.2e-3 J.
    for (dt, momentum, energy) in [(1e-3, 1e-10, 1e-9), (8e-3, 1e-10, 4e-6)] {
        let report = report("box_tumble", dt);
        converged(&report);
        assert!(error(&report) <= momentum, "at {dt}: {:e}", error(&report));
        let gain = report.invariants.energy_gain_j.expect("the change of energy is reported");
        assert!(gain <= energy, "at {dt}: {gain:e} J");
    }
}

#[test]
fn a_tumbling_box_flips_when_the_elliptic_functions_say() {
    // Fourth order in h as well.
    for (dt, percent) in [(1e-3, 2e-6), (8e-3, 8e-3)] {
        let report = report("box_flip", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {:e} %", error(&report));
    }
}

#[test]
fn a_box_turning_about_a_principal_axis_is_where_it_should_be() {
    let report = report("box_simple", 1e-3);
    converged(&report);
    assert!(error(&report) <= 1e-6, "{:e} mm", error(&report));
}

#[test]
fn a_spinning_disc_precesses_at_eulers_rate() {
    // Fourth order in h; at 8 ms it turns in substeps.
    for (dt, percent) in [(1e-3, 2e-6), (8e-3, 5e-3)] {
        let report = report("symmetric_top", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {:e} %", error(&report));
    }
}
