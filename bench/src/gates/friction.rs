//! Sliding and sticking.

use super::{at_most, creeps};

#[test]
fn a_block_on_a_critical_slope_stays_and_on_a_steeper_one_slides() {
    // The glide in the deadband of the correction is a part in ten thousand of friction's pull.
    for report in at_most("incline_critical", &[(1e-3, 0.1), (4e-3, 0.1)]) {
        creeps(&report, 1e-6);
    }
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    // The last step, in which it stops, is not resolved: a h²/2.
    at_most("slide_stop", &[(0.25e-3, 0.05), (1e-3, 0.05), (8e-3, 0.2)]);
}

#[test]
fn a_box_tips_or_slides_where_statics_says() {
    // The search stops at 0.1 %; two seconds are short for a box a few parts in a thousand beyond balance.
    at_most("tip_or_slide", &[0.25e-3, 1e-3, 8e-3, 16e-3].map(|dt| (dt, 0.5)));
}

#[test]
fn a_bead_is_pushed_along_a_gap_as_newton_says() {
    at_most("bead_between_plates", &[(0.25e-3, 0.1), (1e-3, 0.01), (8e-3, 0.02)]);
}
