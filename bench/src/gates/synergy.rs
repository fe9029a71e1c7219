//! Closed forms of adaptive synergies.

use super::at_most;

const STEPS_S: [f64; 5] = [0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3];

#[test]
fn free_closure_is_the_closed_form_at_every_step() {
    at_most("syn_free_close", &STEPS_S.map(|dt| (dt, 1e-9)));
}

#[test]
fn a_pushed_finger_is_the_closed_form_with_the_motor_locked() {
    at_most("syn_push_locked_motor", &STEPS_S.map(|dt| (dt, 1e-9)));
}
