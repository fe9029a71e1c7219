//! Nothing held creeps, and no hand fails.

use super::at_most;

const STEPS: [f64; 4] = [0.25e-3, 1e-3, 8e-3, 16e-3];

#[test]
fn a_shaken_block_does_not_creep() {
    at_most("shaken_grasp", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn rollers_at_rest_on_a_palm_stay() {
    at_most("roller_on_palm", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn soft_round_tips_hold_a_torque_without_creep() {
    at_most("soft_tip_creep", &STEPS.map(|dt| (dt, 1.0)));
}

#[test]
fn a_mimic_joint_is_as_robust_as_another() {
    at_most("mimic_self_contact", &[(1e-3, 0.0), (4e-3, 0.0)]);
}
