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
    // Below 5 cm/s contacts are springs again: a lost bounce or two of the last 0.05 s of 4.06 s.
    for (dt, percent) in [(0.0625e-3, 1.0), (0.25e-3, 1.0), (1e-3, 1.0), (4e-3, 1.0), (16e-3, 5.0)] {
        let report = report("bounce_zeno", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn equal_elastic_balls_hand_their_speed_on_to_the_last() {
    for case in ["newton_cradle", "newton_cradle_touching"] {
        for dt in [0.0625e-3, 0.125e-3, 0.5e-3, 1e-3, 4e-3, 16e-3] {
            let report = report(case, dt);
            converged(&report);
            // A rebound is as good as rigid: a part in a million is missing.
            assert!(error(&report) <= 1e-3, "{case} at {dt}: {} %", error(&report));
            let gain = report.invariants.energy_gain_j.expect("the gain is reported");
            assert!(gain <= 1e-9, "{case} at {dt}: {gain:e} J");
        }
    }
}
