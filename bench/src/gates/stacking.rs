//! Bodies at rest on each other.

use super::at_most;
use crate::case_report::CaseReport;

/// Newton stops at 1e-6 of the impulses; the contact at the top of fifteen has a hundredth of their sum.
const FORCE_PERCENT: f64 = 1e-2;

fn forces_are_right(reports: &[CaseReport]) {
    for report in reports {
        let wrong = report.invariants.force_error_percent.expect("the error of the force is reported");
        assert!(wrong <= FORCE_PERCENT, "{} at {}: {wrong} %", report.case, report.dt_s);
    }
}

#[test]
fn bodies_at_rest_sink_as_far_as_their_stiffness_says() {
    forces_are_right(&at_most("rest_penetration", &[0.25e-3, 1e-3, 8e-3, 16e-3].map(|dt| (dt, 1e-2))));
}

#[test]
fn a_cube_a_million_times_heavier_stands_on_a_light_one_and_is_not_dragged_off() {
    // The springs and anchors of both contacts yield 41 µm and 5 µm under the drag.
    forces_are_right(&at_most("mass_ratio", &[0.25e-3, 1e-3, 4e-3, 16e-3].map(|dt| (dt, 0.06))));
}

#[test]
fn columns_of_up_to_fifteen_spheres_stand_at_every_step() {
    // 15 m g/k = 0.029 µm; ten percent for the motion that is left.
    forces_are_right(&at_most("sphere_stack", &[0.25e-3, 1e-3, 4e-3, 10e-3, 16e-3].map(|dt| (dt, 3.2e-5))));
}

#[test]
fn a_tower_of_a_hundred_planks_stays_within_what_a_step_may_compute() {
    // Its springs yield 0.02 mm, and its anchors as much again.
    at_most("kapla", &[(16e-3, 0.05)]);
}
