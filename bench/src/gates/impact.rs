//! Rebounds.

use super::{converged, error, report};

#[test]
fn elastic_balls_keep_their_energy() {
    for dt in [0.25e-3, 1e-3, 8e-3, 16e-3] {
        let report = report("bounce_elastic", dt);
        converged(&report);
        // (0.55 J)² of 24,034.5 J, lost in the bounces of a contact's first step; the best published figure at 1 ms is 185.
        assert!(error(&report) <= 0.5, "at {dt}: {} J^2", error(&report));
        let gain = report.invariants.energy_gain_j.expect("the gain is reported");
        assert!(gain <= 1e-6, "at {dt}: {gain:e} J");
    }
}

#[test]
fn a_ball_bounces_ever_lower_and_comes_to_rest_in_time() {
    for dt in [0.25e-3, 1e-3, 4e-3, 16e-3] {
        let report = report("bounce_zeno", dt);
        converged(&report);
        // Below 5 cm/s contacts are springs again, which swallow the last 0.05 s of 4.06 s and some bounces before.
        assert!(error(&report) <= 5.0, "at {dt}: {} %", error(&report));
    }
}
