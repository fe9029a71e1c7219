//! Mass matrix M(q) by the composite-rigid-body algorithm (Featherstone 2008, table 6.2).

use super::spatial::RigidInertia;
use super::tree::Kinematics;
use palmares_models::hand::Hand;

/// Inertias of the links about the base origin, and scratch.
#[derive(Clone, Debug, Default)]
pub struct Inertias {
    /// Each link's own.
    pub link: Vec<RigidInertia>,
    composite: Vec<RigidInertia>,
}

impl Inertias {
    /// Re-expresses every link's inertia at the present configuration.
    pub fn update(&mut self, hand: &Hand, kin: &Kinematics) {
        self.link.clear();
        for (i, link) in hand.links.iter().enumerate() {
            let r = kin.rotation[i];
            let com = kin.pose[i].translation - kin.origin + r * link.inertia.com;
            let about_com = r * link.inertia.about_com * r.transpose();
            self.link.push(RigidInertia::new(link.inertia.mass, com, about_com));
        }
    }

    /// Writes M, row-major n x n with n = 6 + coordinates. What no path to the base couples is left as it is: zero.
    /// Coordinates that move several links (mimics) sum.
    pub fn mass_matrix(&mut self, hand: &Hand, kin: &Kinematics, m: &mut [f64]) {
        let n = 6 + hand.coordinates.len();
        let jointed = hand.links.iter().filter(|link| link.joint.is_some()).count();
        let shared = jointed > hand.coordinates.len();
        if shared {
            m[..n * n].fill(0.0);
        }
        let put = |to: &mut f64, x: f64| *to = if shared { *to + x } else { x };
        self.composite.clear();
        self.composite.extend_from_slice(&self.link);
        for i in (1..hand.links.len()).rev() {
            let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) else { continue };
            let own = self.composite[i];
            self.composite[parent] += own;
            let row = 6 + joint.coordinate;
            let f = own.mul(kin.screw[i]);
            put(&mut m[row * n + row], kin.screw[i].dot(f));
            let mut j = parent;
            while let (Some(up), Some(joint)) = (hand.links[j].parent, &hand.links[j].joint) {
                let column = 6 + joint.coordinate;
                let x = kin.screw[j].dot(f);
                put(&mut m[row * n + column], x);
                put(&mut m[column * n + row], x);
                j = up;
            }
            // The base's columns are pure translations and rotations.
            for (k, x) in f.components().into_iter().enumerate() {
                put(&mut m[row * n + k], x);
                put(&mut m[k * n + row], x);
            }
        }
        let base = self.composite[0];
        for k in 0..3 {
            m[k * n + k] = base.mass;
            for j in 0..3 {
                m[(3 + k) * n + 3 + j] = base.rotational.col(j)[k];
            }
        }
        let c = super::spatial::cross_matrix(base.first_moment);
        for k in 0..3 {
            for j in 0..3 {
                m[(3 + k) * n + j] = c.col(j)[k];
                m[j * n + 3 + k] = c.col(j)[k];
            }
        }
    }
}
