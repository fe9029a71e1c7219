//! Small hands as textbook mechanisms.

use super::{converged, error, report};

#[test]
fn a_pendulum_keeps_its_period_and_energy_for_a_hundred_periods() {
    // The energy it has swings with the first order of h within a period, and does not drift.
    for (dt, percent, joule) in [(1e-3, 1e-3, 3e-3), (8e-3, 2e-2, 2.4e-2)] {
        let report = report("pendulum", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
        let swing = report.invariants.energy_gain_j.expect("the change of energy is reported");
        assert!(swing <= joule, "at {dt}: {swing:e} J");
    }
}
