//! Balls stay in their boxes.

use super::at_most;

#[test]
fn no_ball_passes_a_wall() {
    at_most("softhand_balls", &[0.25e-3, 1e-3, 16e-3].map(|dt| (dt, 0.0)));
}
