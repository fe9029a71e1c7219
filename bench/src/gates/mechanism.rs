//! Small hands as textbook mechanisms.

use super::{converged, error, report};

#[test]
fn a_pendulum_keeps_its_period_and_energy_for_a_hundred_periods() {
    // Fifth order in h; it has 0.97 J.
    for (dt, percent, joule) in [(1e-3, 1e-8, 1e-11), (4e-3, 3e-6, 4e-9), (16e-3, 1.8e-3, 4e-6)] {
        let report = report("pendulum", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
        let swing = report.invariants.energy_gain_j.expect("the change of energy is reported");
        assert!(swing <= joule, "at {dt}: {swing:e} J");
    }
}

#[test]
fn a_heavy_top_precesses_steadily() {
    for dt in [0.25e-3, 1e-3, 8e-3, 16e-3] {
        let report = report("heavy_top", dt);
        converged(&report);
        // Where accelerations are zero every stage says the same: rounding is left.
        assert!(error(&report) <= 1e-9, "at {dt}: {:e} %", error(&report));
        let drift = report.invariants.energy_gain_j.expect("the change of energy is reported");
        assert!(drift <= 1e-8, "at {dt}: {drift:e} J");
    }
}

#[test]
fn a_ball_that_hits_a_free_hand_changes_no_momentum() {
    for dt in [1e-3, 8e-3] {
        let report = report("momentum_inelastic_hit", dt);
        converged(&report);
        // Rounding of 50 kg m/s over the joints of a hand; the best published figure at 1 ms is 5e-26.
        assert!(error(&report) <= 5e-26, "at {dt}: {:e} (kg m/s)^2", error(&report));
        let turned = report.invariants.momentum_error_percent.expect("it is reported");
        assert!(turned <= 1e-9, "at {dt}: {turned:e} %");
    }
}
