//! Convergence.

use super::{converged, error, report};

#[test]
fn free_motion_converges_with_first_order_at_least() {
    let report = report("self_consistency", 2e-3);
    converged(&report);
    assert!(error(&report) >= 0.9, "order {}", error(&report));
}
