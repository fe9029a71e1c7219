//! The grasp matrix G and the hand Jacobian J.
//!
//! `w = G λ` is the wrench of the contact forces λ on the object, `τ = Jᵀ λ` the joint torques that balance them. The velocities at the
//! contacts are `Gᵀ ν` on the object and `J q̇` on the hand (Prattichizzo and Trinkle, eqs 28.16 and 28.18). λ has for each
//! contact, in its frame, f_n, then f_t and f_o unless it is frictionless, then m_n if it is soft.

use crate::contact::{BadContact, Contact, LinkContact, check};
use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::dynamics::spatial::SpatialVelocity;
use palmares_sim::dynamics::tree::Kinematics;

/// A hand that touches an object.
#[derive(Clone, Debug)]
pub struct Grasp {
    /// The contacts in the world.
    pub contacts: Vec<Contact>,
    /// The link of each.
    pub links: Vec<usize>,
    /// G, 6 × components: force then moment, in the axes of the object's frame, about its origin.
    pub g: DMatrix<f64>,
    /// J, components × coordinates.
    pub j: DMatrix<f64>,
    /// The object's frame in the world.
    pub object: Pose,
    /// Poses and screws of the hand.
    kin: Kinematics,
}

/// Number of components of all contacts.
pub fn components(contacts: &[Contact]) -> usize {
    contacts.iter().map(|contact| contact.model.components()).sum()
}

/// G of contacts in the world, about the object's frame.
pub fn grasp_matrix(contacts: &[Contact], object: Pose) -> DMatrix<f64> {
    let mut g = DMatrix::zeros(6, components(contacts));
    let back = object.rotation.inverse();
    let mut column = 0;
    for contact in contacts {
        let arm = contact.point - object.translation;
        for (force, moment) in directions(contact) {
            let (force, moment) = (back * force, back * (moment + arm.cross(force)));
            for k in 0..3 {
                g[(k, column)] = force[k];
                g[(3 + k, column)] = moment[k];
            }
            column += 1;
        }
    }
    g
}

/// Force and moment, in the world, of each transmitted component of size 1.
pub(crate) fn directions(contact: &Contact) -> impl Iterator<Item = (Vec3, Vec3)> {
    let [n, t, o] = contact.axes();
    let all = [(n, Vec3::ZERO), (t, Vec3::ZERO), (o, Vec3::ZERO), (Vec3::ZERO, n)];
    all.into_iter().take(contact.model.components())
}

impl Grasp {
    /// The grasp of contacts on the links of a hand with its base at `base` and its coordinates at q. `object` is the object's
    /// frame in the world.
    ///
    /// # Errors
    /// A contact that is not on the hand, or has numbers that are not valid.
    pub fn new(
        hand: &Hand,
        base: Pose,
        q: &[f64],
        contacts: &[LinkContact],
        object: Pose,
    ) -> Result<Self, BadContact> {
        check(hand, contacts)?;
        let mut kin = Kinematics::default();
        kin.update(hand, base, q);
        let placed: Vec<Contact> = contacts.iter().map(|contact| contact.placed(hand, &kin)).collect();
        let links: Vec<usize> = contacts.iter().map(|contact| contact.link).collect();
        let g = grasp_matrix(&placed, object);
        let mut j = DMatrix::zeros(g.ncols(), hand.coordinates.len());
        let mut row = 0;
        for (contact, &link) in placed.iter().zip(&links) {
            let arm = contact.point - kin.origin;
            for (force, moment) in directions(contact) {
                for (i, coordinate) in chain(hand, link) {
                    let screw = kin.screw[i];
                    j[(row, coordinate)] += screw.at(arm).dot(force) + screw.angular.dot(moment);
                }
                row += 1;
            }
        }
        Ok(Grasp { contacts: placed, links, g, j, object, kin })
    }

    /// Force and moment of each contact on the object, in the world, for λ.
    pub fn wrenches(&self, forces: &DVector<f64>) -> Vec<(Vec3, Vec3)> {
        let mut component = 0;
        let of = |contact: &Contact| {
            let mut sum = (Vec3::ZERO, Vec3::ZERO);
            for (force, moment) in directions(contact) {
                sum.0 += force * forces[component];
                sum.1 += moment * forces[component];
                component += 1;
            }
            sum
        };
        self.contacts.iter().map(of).collect()
    }

    /// `∂(Jᵀ λ)/∂q` for contact forces that stay as they are in the world while the points move with their links: the
    /// geometric stiffness of the hand.
    pub fn hand_geometric_stiffness(&self, hand: &Hand, forces: &DVector<f64>) -> DMatrix<f64> {
        let n = hand.coordinates.len();
        let mut stiffness = DMatrix::zeros(n, n);
        for ((contact, &link), (force, moment)) in
            self.contacts.iter().zip(&self.links).zip(self.wrenches(forces))
        {
            let point = contact.point - self.kin.origin;
            for (inner, a) in chain(hand, link) {
                for (outer, b) in chain(hand, link) {
                    stiffness[(a, b)] += self.second_derivative(hand, inner, outer, point, force, moment);
                }
            }
        }
        stiffness
    }

    /// The change of the torque of a force on link `inner`'s joint while the coordinate of link `outer` moves.
    fn second_derivative(
        &self,
        hand: &Hand,
        inner: usize,
        outer: usize,
        point: Vec3,
        force: Vec3,
        moment: Vec3,
    ) -> f64 {
        let (screw, mover) = (self.kin.screw[inner], self.kin.screw[outer]);
        // A joint's screw moves with the joints before it; of its own two hinges, the second moves with the first.
        let turned = if inner == outer {
            let first = self.kin.first_screw[inner];
            first.cross(screw - first)
        } else if is_ancestor(hand, outer, inner) {
            mover.cross(screw)
        } else {
            SpatialVelocity::ZERO
        };
        let moved_point = screw.angular.cross(mover.at(point));
        turned.at(point).dot(force) + turned.angular.dot(moment) + moved_point.dot(force)
    }

    /// `∂(G λ)/∂u` for forces that stay as they are in the world while the points move with the object: 6 × 6, in the
    /// object's axes. u is a small translation of the object's origin, then a small rotation.
    pub fn object_geometric_stiffness(&self, forces: &DVector<f64>) -> DMatrix<f64> {
        let back = self.object.rotation.inverse();
        let mut stiffness = DMatrix::zeros(6, 6);
        for (contact, (force, _)) in self.contacts.iter().zip(self.wrenches(forces)) {
            let (arm, force) = (back * (contact.point - self.object.translation), back * force);
            for k in 0..3 {
                let axis = Vec3::AXES[k];
                let change = axis.cross(arm).cross(force);
                for i in 0..3 {
                    stiffness[(3 + i, 3 + k)] += change[i];
                }
            }
        }
        stiffness
    }
}

/// Links with joints from this one to the base, each with its coordinate.
fn chain(hand: &Hand, link: usize) -> impl Iterator<Item = (usize, usize)> {
    let mut next = Some(link);
    std::iter::from_fn(move || {
        let link = next?;
        let joint = hand.links[link].joint.as_ref()?;
        next = hand.links[link].parent;
        Some((link, joint.coordinate))
    })
}

/// Whether `a` is on the way from `b` to the base.
fn is_ancestor(hand: &Hand, a: usize, b: usize) -> bool {
    let mut at = hand.links[b].parent;
    while let Some(link) = at {
        if link == a {
            return true;
        }
        at = hand.links[link].parent;
    }
    false
}
