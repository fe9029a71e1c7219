//! What friction holds rides along with what turns.

use super::at_most;

// At 16 ms the palm turns by a twentieth of a radian in a step.
const STEPS: [f64; 4] = [0.25e-3, 1e-3, 4e-3, 8e-3];

#[test]
fn a_block_stays_on_a_palm_that_turns() {
    // Coulomb: friction that is not used up holds. A micrometre a minute is what rounding and tolerance may leave.
    at_most("turning_palm", &STEPS.map(|dt| (dt, 1.0)));
    at_most("turning_palm_servo", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn a_block_stays_on_a_turntable_near_the_limit() {
    at_most("turntable", &STEPS.map(|dt| (dt, 1e-3)));
}

#[test]
fn a_grip_on_a_palm_that_turns_does_not_creep() {
    at_most("turning_grip", &STEPS.map(|dt| (dt, 1e-3)));
}
