//! Dry friction in second order.

use super::at_most;

/// 2 % at 4 ms, and from there with the square of the step.
fn bounds() -> [(f64, f64); 5] {
    [0.25e-3, 1e-3, 4e-3, 8e-3, 16e-3].map(|dt: f64| (dt, 2.0 * (dt / 4e-3).max(1.0).powi(2)))
}

#[test]
fn dry_friction_of_a_joint_takes_its_part_of_every_half_cycle() {
    at_most("dry_joint", &bounds());
}

#[test]
fn dry_friction_of_a_contact_takes_its_part_of_every_half_cycle() {
    at_most("dry_contact", &bounds());
}

#[test]
fn dry_friction_of_a_link_takes_its_part_of_every_half_cycle() {
    at_most("dry_contact_joint", &bounds());
}
