//! Grasps hold.

use super::{converged, error, report};

const GRASPS: [&str; 2] = ["softhand_cylinder", "softhand_box"];

#[test]
fn grasps_hold_while_shaken_at_every_step() {
    for case in GRASPS {
        let mut finest = None;
        for dt in [0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
            let report = report(case, dt);
            converged(&report);
            let seen = &report.invariants;
            assert_eq!(seen.held, Some(true), "{case} at {dt}");
            let slip = seen.slip_mm_s.expect("grasps report slip");
            assert!(slip <= 1e-3, "{case} at {dt}: {slip} mm/s");
            let balance = seen.tension_balance_nm.expect("grasps report the balance of tension");
            let residual = seen.static_residual_nm.expect("grasps report the static residual");
            assert!(residual + balance <= 1e-6, "{case} at {dt}: {residual:e} N m");
            let hold = seen.hold_penetration_mm.expect("grasps report the depth of the hold");
            let finest = *finest.get_or_insert(hold);
            // The contact law does not depend on the step.
            assert!((hold / finest - 1.0).abs() <= 0.1, "{case} at {dt}: {hold} mm after {finest} mm");
            if dt == 1e-3 {
                let depth = seen.max_penetration_mm.expect("grasps report depth");
                assert!(depth <= 0.5, "{case} at {dt}: {depth} mm");
            }
        }
    }
}

#[test]
fn nothing_creeps_out_of_the_hand_in_a_minute() {
    for case in ["softhand_cylinder_60s", "softhand_box_60s"] {
        // The full minute at 1 ms is a matter of `palmares-bench case`.
        let report = report(case, 8e-3);
        converged(&report);
        assert_eq!(report.invariants.held, Some(true), "{case}");
        assert!(error(&report) <= 1e-3, "{case}: {:e} mm/s", error(&report));
    }
}
