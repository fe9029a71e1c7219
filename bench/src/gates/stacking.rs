//! Bodies at rest on each other.

use super::{converged, error, report};
use crate::report::Report;

/// Newton stops at 1e-6 of the impulses; the contact at the top of fifteen has a hundredth of their sum.
const FORCE_PERCENT: f64 = 1e-2;

fn force_error(report: &Report) -> f64 {
    report.invariants.force_error_percent.expect("the error of the force is reported")
}

#[test]
fn bodies_at_rest_sink_as_far_as_their_stiffness_says() {
    for dt in [1e-3, 8e-3] {
        let report = report("rest_penetration", dt);
        converged(&report);
        assert!(error(&report) <= 1e-2, "at {dt}: {} %", error(&report));
        assert!(force_error(&report) <= FORCE_PERCENT, "at {dt}: {} %", force_error(&report));
    }
}

#[test]
fn a_cube_a_million_times_heavier_stands_on_a_light_one_and_is_not_dragged_off() {
    for dt in [0.25e-3, 1e-3, 4e-3, 16e-3] {
        let report = report("mass_ratio", dt);
        converged(&report);
        // The springs and anchors of both contacts yield 41 µm and 5 µm under the drag.
        assert!(error(&report) <= 0.06, "at {dt}: {} mm", error(&report));
        assert!(force_error(&report) <= FORCE_PERCENT, "at {dt}: {} %", force_error(&report));
    }
}

#[test]
fn columns_of_up_to_fifteen_spheres_stand_at_every_step() {
    for dt in [0.25e-3, 1e-3, 4e-3, 10e-3, 16e-3] {
        let report = report("sphere_stack", dt);
        converged(&report);
        // 15 m g/k = 0.029 µm; ten percent for what has not come to rest.
        assert!(error(&report) <= 3.2e-5, "at {dt}: {} mm", error(&report));
        assert!(force_error(&report) <= FORCE_PERCENT, "at {dt}: {} %", force_error(&report));
    }
}
