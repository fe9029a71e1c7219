//! The hand as a mechanism.

use super::{at_most, converged, error, report};

#[test]
fn an_undamped_chain_keeps_its_energy() {
    for case in ["chain_energy", "chain_energy_springs"] {
        at_most(case, &[(1e-3, 0.1)]);
    }
}

#[test]
fn rolling_joints_roll() {
    at_most("rolling_joint_path", &[(1e-3, 1e-12), (8e-3, 1e-12)]);
}

#[test]
fn a_stiff_joint_is_stable_at_every_step_and_converges() {
    let mut last = f64::INFINITY;
    for dt in [8e-3, 4e-3, 2e-3, 1e-3, 0.5e-3] {
        let report = report("spring_joint_stiff", dt);
        converged(&report);
        let error = error(&report);
        // First order at least: half the step, half the error.
        assert!(error <= 0.55 * last, "{dt}: {error:e} rad after {last:e} rad");
        last = error;
    }
    assert!(last <= 1e-3, "{last:e} rad");
}
