//! Ends of the ranges.

use super::{STEPS, at_most, creeps};

#[test]
fn plates_slide_and_hold_without_friction_and_with_a_friction_of_three() {
    // That of `incline_critical`.
    for report in at_most("friction_ends", &STEPS.map(|dt| (dt, 0.1))) {
        creeps(&report, 1e-6);
    }
}

#[test]
fn a_cube_of_a_millimetre_and_one_of_two_metres_stop_where_coulomb_says() {
    // The last step, in which the small one stops, is not resolved: μ g h²/2 of 20 mm.
    let bounds = [(0.25e-3, 0.05), (1e-3, 0.05), (4e-3, 0.118), (16e-3, 1.884)];
    at_most("small_and_large", &bounds);
}
