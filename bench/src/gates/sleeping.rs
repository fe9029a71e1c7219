//! Only what rests sleeps.

use super::{STEPS, at_most};

#[test]
fn a_ball_on_a_gentle_slope_returns() {
    at_most("slope_return", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn a_roly_poly_swings_on() {
    // One that rests is off by its whole amplitude. Seven swings; implicit contacts damp them in longer steps.
    at_most("roly_poly", &[(0.25e-3, 1.0), (1e-3, 1.0), (4e-3, 10.0), (8e-3, 10.0), (16e-3, 20.0)]);
}

#[test]
fn what_sleeps_still_presses() {
    // Statics: the forces carry the weight.
    at_most("asleep_presses", &STEPS.map(|dt| (dt, 0.1)));
}
