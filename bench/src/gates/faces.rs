//! Faces on faces, and patches that turn.

use super::{at_most, creeps};

const STEPS: [f64; 4] = [0.25e-3, 1e-3, 8e-3, 16e-3];

#[test]
fn hulls_of_any_number_of_corners_rest() {
    for report in at_most("hull_on_ground", &STEPS.map(|dt| (dt, 0.1))) {
        creeps(&report, 1e-3);
    }
}

#[test]
fn hulls_hold_on_slopes_up_to_the_critical_one() {
    at_most("hull_on_slope", &STEPS.map(|dt| (dt, 1e-3)));
}

#[test]
fn flush_slabs_are_as_one() {
    at_most("internal_edges", &[0.25e-3, 1e-3, 8e-3].map(|dt| (dt, 1.0)));
}

#[test]
fn what_touches_exactly_stays() {
    at_most("touching_faces", &STEPS.map(|dt| (dt, 1e-6)));
}

#[test]
fn what_begins_slowly_does_not_sleep() {
    at_most("slow_start", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn an_even_pressure_brakes_spin() {
    // At 16 ms the step in which spin stops is a tenth of the time.
    at_most("patch_spin", &[0.25e-3, 1e-3, 8e-3].map(|dt| (dt, 5.0)));
    at_most("round_tips", &STEPS.map(|dt| (dt, 5.0)));
    at_most("disc_contensou", &STEPS.map(|dt| (dt, 5.0)));
    for report in at_most("pinch_tilt_torsion", &[(1e-3, 5.0)]) {
        assert!(super::error(&report) >= -5.0);
    }
}
