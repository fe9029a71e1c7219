//! Generalized forces of forces on links: τ = Jᵀ w.

use super::spatial::Force;
use super::tree::Kinematics;
use palmares_models::Vec3;
use palmares_models::hand::Hand;

/// Adds `scale · Jᵀ w` of a force at a point of a link to `tau` (6 + coordinates).
///
/// `point` and `force` are in the world frame.
pub fn add_point_force(
    hand: &Hand,
    kin: &Kinematics,
    link: usize,
    point: Vec3,
    force: Vec3,
    scale: f64,
    tau: &mut [f64],
) {
    let r = point - kin.origin;
    add_link_force(hand, kin, link, Force { moment: r.cross(force), force }, scale, tau);
}

/// Adds `scale · Jᵀ τ` of a torque on one link.
pub fn add_link_torque(
    hand: &Hand,
    kin: &Kinematics,
    link: usize,
    torque: Vec3,
    scale: f64,
    tau: &mut [f64],
) {
    add_link_force(hand, kin, link, Force { moment: torque, force: Vec3::ZERO }, scale, tau);
}

/// Adds `scale · Sᵀ f` of a spatial force about the base origin on one link.
pub fn add_link_force(hand: &Hand, kin: &Kinematics, link: usize, f: Force, scale: f64, tau: &mut [f64]) {
    let parts = [f.force.x, f.force.y, f.force.z, f.moment.x, f.moment.y, f.moment.z];
    for (k, x) in parts.into_iter().enumerate() {
        tau[k] += scale * x;
    }
    let mut i = link;
    while let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
        tau[6 + joint.coordinate] += scale * kin.screw[i].dot(f);
        i = parent;
    }
}
