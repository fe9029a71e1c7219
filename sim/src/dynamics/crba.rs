//! Mass matrix M(q) by the composite-rigid-body algorithm (Featherstone 2008, table 6.2).

use super::spatial::RigidInertia;
use super::tree::Kinematics;
use palmares_models::Mat3;
use palmares_models::hand::Hand;

/// Inertias of the links about the base origin, and scratch.
#[derive(Clone, Debug, Default)]
pub struct Inertias {
    /// Inertia of each link.
    pub link: Vec<RigidInertia>,
    /// Index of the first inertia of the present configuration: 1 while the base rests, otherwise 0.
    pub(super) first: usize,
    composite: Vec<RigidInertia>,
}

/// `r m` of a matrix that is often diagonal.
#[inline]
fn turned(r: Mat3, m: &Mat3) -> Mat3 {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let beside = [x.y, x.z, y.x, y.z, z.x, z.y];
    if beside == [0.0; 6] { Mat3::from_cols(r.x_axis * x.x, r.y_axis * y.y, r.z_axis * z.z) } else { r * *m }
}

impl Inertias {
    /// Recomputes every link's inertia at the present configuration, or those of the links from `first` on.
    pub fn update(&mut self, hand: &Hand, kin: &Kinematics, first: usize) {
        self.first = first;
        self.link.truncate(first);
        for (i, link) in hand.links.iter().enumerate().skip(first) {
            let r = kin.rotation[i];
            let com = kin.pose[i].translation - kin.origin + r * link.inertia.com;
            let about_com = turned(r, &link.inertia.about_com) * r.transpose();
            self.link.push(RigidInertia::new(link.inertia.mass, com, about_com));
        }
    }

    /// Writes M, row-major n x n with n = 6 + coordinates. Entries that no path to the base couples stay
    /// zero. Coordinates that move several links (mimics) sum.
    pub fn mass_matrix(&mut self, hand: &Hand, kin: &Kinematics, m: &mut [f64]) {
        self.joints::<true>(hand, kin, m);
        let n = 6 + hand.coordinates.len();
        let base = self.composite[0];
        for k in 0..3 {
            for j in 0..3 {
                m[k * n + j] = if j == k { base.mass } else { 0.0 };
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

    /// Writes the part of M that belongs to the joints alone.
    pub fn joint_matrix(&mut self, hand: &Hand, kin: &Kinematics, m: &mut [f64]) {
        self.joints::<false>(hand, kin, m);
    }

    fn joints<const BASE: bool>(&mut self, hand: &Hand, kin: &Kinematics, m: &mut [f64]) {
        let jointed = hand.links.iter().filter(|link| link.joint.is_some()).count();
        if jointed > hand.coordinates.len() {
            let n = 6 + hand.coordinates.len();
            m[..n * n].fill(0.0);
            self.tree_matrix::<BASE, true>(hand, kin, m);
        } else {
            self.tree_matrix::<BASE, false>(hand, kin, m);
        }
    }

    /// The joints' part of M, and on request their coupling with the base. Entries add up if several joints share a coordinate.
    fn tree_matrix<const BASE: bool, const SHARED: bool>(
        &mut self,
        hand: &Hand,
        kin: &Kinematics,
        m: &mut [f64],
    ) {
        let n = 6 + hand.coordinates.len();
        let put = |to: &mut f64, x: f64| *to = if SHARED { *to + x } else { x };
        self.composite.clear();
        self.composite.extend_from_slice(&self.link);
        for i in (1..hand.links.len()).rev() {
            let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) else { continue };
            let own = self.composite[i];
            if BASE || parent > 0 {
                self.composite[parent] += own;
            }
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
            if !BASE {
                continue;
            }
            // The base's columns are pure translations and rotations.
            for (k, x) in f.components().into_iter().enumerate() {
                put(&mut m[row * n + k], x);
                put(&mut m[k * n + row], x);
            }
        }
    }
}
