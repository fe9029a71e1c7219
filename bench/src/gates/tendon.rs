//! Tendons: blocked, slack, through a cycle.

use super::{at_most, converged, error, gains, report};

#[test]
fn a_blocked_joint_leaves_the_others_to_the_closed_form() {
    at_most("syn_joint_blocked", &[0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3].map(|dt| (dt, 1e-8)));
}

#[test]
fn a_slack_cable_neither_pushes_nor_pulls() {
    // The case itself fails if the cable pushes or pulls while slack. The swing's error falls with the step.
    let (coarse, fine) = (report("syn_slack", 1e-3), report("syn_slack", 0.25e-3));
    converged(&coarse);
    converged(&fine);
    assert!(error(&fine) <= 0.35 * error(&coarse), "{:e} {:e}", error(&coarse), error(&fine));
}

#[test]
fn what_the_motor_gives_in_a_cycle_is_accounted_for() {
    for report in at_most("syn_energy", &[0.5e-3, 1e-3, 2e-3].map(|dt| (dt, 1.0))) {
        gains(&report, 1e-4);
    }
}
