//! Small hands as textbook mechanisms.

use super::{STEPS, at_most, gains};

#[test]
fn a_pendulum_keeps_its_period_and_energy_for_a_hundred_periods() {
    // Fifth order in h; it has 0.97 J.
    for (dt, percent, joule) in [(1e-3, 1e-8, 1e-11), (4e-3, 3e-6, 4e-9), (16e-3, 1.8e-3, 4e-6)] {
        gains(&at_most("pendulum", &[(dt, percent)])[0], joule);
    }
}

#[test]
fn a_heavy_top_precesses_steadily() {
    // All joint accelerations are zero, so every stage gives the same: only rounding is left.
    for report in at_most("heavy_top", &[0.25e-3, 1e-3, 8e-3, 16e-3].map(|dt| (dt, 1e-9))) {
        gains(&report, 1e-8);
    }
}

#[test]
fn a_ball_that_hits_a_free_hand_changes_no_momentum() {
    // Rounding of 50 kg m/s over the joints of a hand; the best published figure at 1 ms is 5e-26.
    for report in at_most("momentum_inelastic_hit", &[(1e-3, 5e-26), (8e-3, 5e-26)]) {
        let turned = report.invariants.momentum_error_percent.expect("it is reported");
        assert!(turned <= 1e-9, "at {}: {turned:e} %", report.dt_s);
    }
}

#[test]
fn an_arm_swings_through_its_singular_positions() {
    // A requirement: a hundredth of a percent in ten seconds. Methods of first order lose percents.
    at_most("singular_arm", &STEPS.map(|dt| (dt, 0.01)));
}
