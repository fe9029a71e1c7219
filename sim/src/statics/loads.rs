//! Torques of pushes and weight on the joints.

use crate::bounds::LINK_WORK;
use crate::command::Push;
use crate::config::Config;
use crate::dynamics::jacobian::add_point_force;
use crate::dynamics::tree::Kinematics;
use palmares_models::Pose;
use palmares_models::hand::Hand;

/// Jᵀ of pushes and of uncompensated weight at coordinates q: a torque on each coordinate.
pub fn torques(config: &Config, hand: &Hand, base: Pose, q: &[f64], pushes: &[Push]) -> Vec<f64> {
    let mut kin = Kinematics::default();
    kin.update(hand, base, q);
    let mut tau = vec![0.0; 6 + hand.coordinates.len()];
    for push in pushes {
        let at = kin.pose[push.link].transform_point(push.point);
        add_point_force(hand, &kin, push.link, at, push.force, 1.0, &mut tau);
    }
    if !hand.gravity_compensation {
        for (i, link) in hand.links.iter().enumerate() {
            let at = kin.pose[i].transform_point(link.inertia.com);
            add_point_force(hand, &kin, i, at, config.gravity * link.inertia.mass, 1.0, &mut tau);
        }
    }
    tau.split_off(6)
}

/// Largest computing of [`torques`]: every force goes down the tree to the base.
pub(super) fn torque_work(hand: &Hand, pushes: usize) -> u64 {
    let forces = (hand.links.len() + pushes) as u64;
    LINK_WORK * hand.links.len() as u64 + 10 * forces * hand.coordinates.len() as u64
}
