//! Balls stay in their boxes.

use super::at_most;

#[test]
fn no_ball_passes_a_wall() {
    at_most("softhand_balls", &[(1e-3, 0.0)]);
}
