//! Spin.

use super::{STEPS, at_most};

#[test]
fn a_ball_that_slides_keeps_its_spin_about_the_vertical() {
    // No torque acts about the vertical, no force across: rounding alone.
    at_most("ball_spin", &STEPS.map(|dt| (dt, 1e-6)));
}

#[test]
fn a_top_keeps_its_angular_momentum_about_the_vertical() {
    // No torque acts; the required bound. At 16 ms it turns by four radians in a step, and falls.
    at_most("top_momentum", &[0.25e-3, 1e-3, 4e-3, 8e-3].map(|dt| (dt, 0.1)));
}

#[test]
fn a_coin_on_its_rim_keeps_its_energy() {
    // Rolling costs nothing; the required bound.
    at_most("coin_rim", &STEPS.map(|dt| (dt, 0.5)));
}
