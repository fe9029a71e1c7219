//! Grasps hold.

use super::{converged, report};

#[test]
fn grasps_hold_at_every_step() {
    for case in ["softhand_cylinder", "softhand_box"] {
        for dt in [0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
            let report = report(case, dt);
            converged(&report);
            let seen = &report.invariants;
            assert_eq!(seen.held, Some(true), "{case} at {dt}");
            let slip = seen.slip_mm_s.expect("grasps report slip");
            assert!(slip <= 1e-3, "{case} at {dt}: {slip} mm/s");
            if dt == 1e-3 {
                let depth = seen.max_penetration_mm.expect("grasps report depth");
                assert!(depth <= 0.5, "{case} at {dt}: {depth} mm");
            }
        }
    }
}
