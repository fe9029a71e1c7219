//! Nothing held creeps, and no hand fails.

use super::at_most;

#[test]
fn a_shaken_block_does_not_creep() {
    at_most("shaken_grasp", &[(1e-3, 1.0), (8e-3, 1.0)]);
}

#[test]
fn rollers_at_rest_on_a_palm_stay() {
    at_most("roller_on_palm", &[(1e-3, 1.0), (8e-3, 1.0)]);
}

#[test]
fn soft_round_tips_hold_a_torque_without_creep() {
    at_most("soft_tip_creep", &[(1e-3, 1.0), (8e-3, 1.0)]);
}

#[test]
fn a_mimic_joint_is_as_robust_as_another() {
    at_most("mimic_self_contact", &[(1e-3, 0.0), (4e-3, 0.0)]);
}
