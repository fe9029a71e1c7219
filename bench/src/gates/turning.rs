//! Palms that turn.

use super::at_most;

#[test]
fn a_block_at_a_fifth_of_its_friction_stays_on_a_palm_that_turns() {
    // A micrometre a minute is what a surface's roughness hides.
    for case in ["turning_palm", "turning_palm_servo"] {
        at_most(case, &[1e-3, 4e-3, 8e-3].map(|dt| (dt, 1.0)));
    }
}

#[test]
fn a_block_below_the_limit_of_friction_stays_on_a_turntable() {
    at_most("turntable_limit", &[0.25e-3, 1e-3, 4e-3, 8e-3, 16e-3].map(|dt| (dt, 1.0)));
}
