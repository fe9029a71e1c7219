//! The pinch hand, which is data only, holds what it takes.

use super::{converged, error, report};

#[test]
fn a_ball_is_taken_between_two_fingertips_lifted_and_held() {
    for dt in [0.25e-3, 1e-3, 4e-3, 8e-3] {
        let report = report("pinch_ball", dt);
        converged(&report);
        assert_eq!(report.invariants.held, Some(true), "at {dt}");
        assert!(error(&report) <= 1e-3, "at {dt}: {:e} mm/s", error(&report));
    }
}
