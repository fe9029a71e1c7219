//! Holding.

use super::{converged, error, report};

#[test]
fn a_pinch_slips_and_holds_as_coulomb_says() {
    for dt in [1e-3, 4e-3] {
        let report = report("pinch_hold", dt);
        converged(&report);
        assert!(error(&report) <= 1.0, "{dt}: {} %", error(&report));
        let creep = report.invariants.slip_mm_s.expect("creep is reported");
        assert!(creep <= 1e-6, "{dt}: {creep:e} mm/s");
    }
}
