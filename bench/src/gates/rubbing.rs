//! Cables that rub, and dry joints: 1 % of the closed forms at every step.

use super::{at_most, gains};

const STEPS: [f64; 4] = [0.25e-3, 1e-3, 8e-3, 16e-3];

#[test]
fn tension_changes_at_a_guide_by_the_capstan_law() {
    at_most("capstan", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn a_cycle_loses_the_area_of_its_loop() {
    at_most("capstan_loop", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn a_dry_joint_stops_where_coulomb_says_and_stays() {
    // The way is 125 mm. The last step counts with v h^2/t = 0.26 mm at 8 ms.
    for report in at_most("dry_slide", &STEPS.map(|dt| (dt, 1e-5 + 4.0 * dt * dt))) {
        gains(&report, 2e-5);
    }
}
