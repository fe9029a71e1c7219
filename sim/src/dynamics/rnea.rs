//! Bias forces c(q, v) by the recursive Newton–Euler algorithm (Featherstone 2008, table 5.1).

use super::crba::Inertias;
use super::spatial::{Force, SpatialVelocity};
use super::tree::Kinematics;
use palmares_models::Vec3;
use palmares_models::hand::Hand;

/// Scratch of the recursion.
#[derive(Clone, Debug, Default)]
pub struct Recursion {
    /// Spatial velocity of every link about the base origin.
    pub velocity: Vec<SpatialVelocity>,
    acceleration: Vec<SpatialVelocity>,
    force: Vec<Force>,
}

impl Recursion {
    /// Writes c so that `M v̇ + c = τ`: Coriolis, centrifugal and gravity forces.
    ///
    /// If the inertias are those of the moving links alone, the base rests, and its rows are skipped. Gravity
    /// is skipped if the hand compensates it: the compensating torque is the exact G(q) of the hand's own
    /// links (Rocchi & Hauser 2016, eq. 6), so the two cancel identically.
    pub fn bias(
        &mut self,
        hand: &Hand,
        kin: &Kinematics,
        inertias: &Inertias,
        v: &[f64],
        gravity: Vec3,
        c: &mut [f64],
    ) {
        let (n, first) = (hand.links.len(), inertias.first);
        let gravity = if hand.gravity_compensation { Vec3::ZERO } else { gravity };
        kin.velocities(hand, v, &mut self.velocity);
        self.acceleration.resize(n, SpatialVelocity::ZERO);
        self.force.resize(n, Force::ZERO);
        // v holds the classical velocity of the base origin; its spatial acceleration at v̇ = 0 is −ω × ṗ.
        let base = self.velocity[0];
        self.acceleration[0] =
            SpatialVelocity { angular: Vec3::ZERO, linear: -base.angular.cross(base.linear) - gravity };
        for (i, link) in hand.links.iter().enumerate().skip(first) {
            if let (Some(parent), Some(joint)) = (link.parent, &link.joint) {
                let rate = v[6 + joint.coordinate];
                let mut acceleration = self.acceleration[parent];
                let (mut before, mut way) = (self.velocity[parent], kin.screw[i] * rate);
                if joint.hinges.len() > 1 {
                    let inner = kin.first_screw[i] * rate;
                    acceleration += before.cross(inner);
                    (before, way) = (before + inner, way - inner);
                }
                if parent >= first || joint.hinges.len() > 1 {
                    acceleration += before.cross(way);
                }
                self.acceleration[i] = acceleration;
            }
            let momentum = inertias.link[i].mul(self.velocity[i]);
            self.force[i] =
                inertias.link[i].mul(self.acceleration[i]) + self.velocity[i].cross_force(momentum);
        }
        c[..6 + hand.coordinates.len()].fill(0.0);
        for i in (1..n).rev() {
            let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) else { continue };
            let f = self.force[i];
            c[6 + joint.coordinate] += kin.screw[i].dot(f);
            if parent >= first {
                self.force[parent] += f;
            }
        }
        if first > 0 {
            return;
        }
        let f = self.force[0];
        for (k, x) in
            [f.force.x, f.force.y, f.force.z, f.moment.x, f.moment.y, f.moment.z].into_iter().enumerate()
        {
            c[k] += x;
        }
    }
}
