//! What friction holds rides along with what turns.

use super::{STEPS, at_most};

#[test]
fn a_block_stays_on_a_palm_that_turns() {
    // Coulomb: friction that is not used up holds. A micrometre a minute is what rounding and tolerance may leave.
    // At 16 ms the palm turns by a twentieth of a radian in a step.
    let steps = [0.25e-3, 1e-3, 4e-3, 8e-3];
    at_most("turning_palm", &steps.map(|dt| (dt, 1.0)));
    at_most("turning_palm_servo", &steps.map(|dt| (dt, 1.0)));
}

#[test]
fn a_block_stays_on_a_turntable_near_the_limit() {
    at_most("turntable", &STEPS.map(|dt| (dt, 1e-3)));
}

#[test]
fn a_grip_on_a_palm_that_turns_does_not_creep() {
    at_most("turning_grip", &STEPS.map(|dt| (dt, 1e-3)));
}
