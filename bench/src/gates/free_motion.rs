//! Free bodies.

use super::{at_most, gains};

#[test]
fn a_thrown_box_flies_the_parabola() {
    // 400 m in up to 40,000 rounded sums; the best published figure at 1 ms is 24.5 mm.
    at_most("free_flight", &[0.25e-3, 1e-3, 16e-3].map(|dt| (dt, 1e-6)));
}

#[test]
fn a_tumbling_box_keeps_its_angular_momentum_and_energy() {
    // L is constant except for rounding, E to the fourth order in h. Published at 1 ms: 6.4e-3 and 6.2e-3 J.
    for (dt, momentum, energy) in [(1e-3, 1e-10, 1e-9), (8e-3, 1e-10, 4e-6)] {
        gains(&at_most("box_tumble", &[(dt, momentum)])[0], energy);
    }
}

#[test]
fn a_tumbling_box_flips_when_the_elliptic_functions_say() {
    // Fourth order in h as well.
    at_most("box_flip", &[(1e-3, 2e-6), (8e-3, 8e-3)]);
}

#[test]
fn a_box_turning_about_a_principal_axis_is_where_it_should_be() {
    at_most("box_simple", &[(1e-3, 1e-6)]);
}

#[test]
fn a_spinning_disc_precesses_at_eulers_rate() {
    // Fourth order in h; at 8 ms it turns in substeps.
    at_most("symmetric_top", &[(1e-3, 2e-6), (8e-3, 5e-3)]);
}
