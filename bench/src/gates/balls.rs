//! Balls stay in their boxes.

use super::{converged, error, report};

#[test]
fn no_ball_passes_a_wall() {
    let report = report("softhand_balls", 1e-3);
    converged(&report);
    assert_eq!(error(&report), 0.0);
}
