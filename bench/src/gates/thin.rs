//! Thin things.

use super::at_most;

#[test]
fn no_rod_passes_through_a_thin_plate() {
    at_most("thin_plate", &[0.25e-3, 1e-3, 4e-3, 10e-3, 16e-3].map(|dt| (dt, 0.0)));
}

#[test]
fn nothing_small_passes_through_a_thin_plate() {
    at_most("thin_things", &[0.25e-3, 1e-3, 4e-3, 10e-3, 16e-3].map(|dt| (dt, 0.0)));
}
