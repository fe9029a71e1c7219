//! Small hands as textbook mechanisms.

use super::{converged, error, report};

#[test]
fn a_pendulum_keeps_its_period_and_energy_for_a_hundred_periods() {
    // Second order in h; it has 0.97 J.
    for (dt, percent, joule) in [(1e-3, 3e-4, 4e-6), (4e-3, 4e-3, 6e-5)] {
        let report = report("pendulum", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
        let swing = report.invariants.energy_gain_j.expect("the change of energy is reported");
        assert!(swing <= joule, "at {dt}: {swing:e} J");
    }
}
