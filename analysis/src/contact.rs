//! Contacts between a hand and an object: their frames, models and friction.

use crate::equilibrium::own_frame;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_sim::dynamics::tree::Kinematics;
use serde::{Deserialize, Serialize};

/// The components of force and moment that a contact transmits (Prattichizzo and Trinkle, section "Contact modelling").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactModel {
    /// Point contact without friction: the normal force.
    Frictionless,
    /// Hard finger: a force.
    HardFinger,
    /// Soft finger: a force, and a moment about the normal.
    SoftFinger,
}

impl ContactModel {
    /// Number of transmitted components: 1, 3 or 4.
    pub fn components(self) -> usize {
        match self {
            ContactModel::Frictionless => 1,
            ContactModel::HardFinger => 3,
            ContactModel::SoftFinger => 4,
        }
    }
}

/// Arm of the friction moment of a soft finger if none is given, m.
pub const DEFAULT_ARM: f64 = 0.005;

/// A contact in the world. Its frame has the axes n (normal, into the object), t and o = n × t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Position, m.
    pub point: Vec3,
    /// Unit normal, out of the hand and into the object.
    pub normal: Vec3,
    /// Unit tangent t, orthogonal to the normal.
    pub tangent: Vec3,
    /// Transmitted components.
    pub model: ContactModel,
    /// Coulomb coefficient μ.
    pub friction: f64,
    /// Arm of the friction moment, m: `f_t² + f_o² + (m/arm)² ≤ (μ f_n)²`, the law of the simulation's soft contacts.
    pub arm: f64,
}

impl Contact {
    /// A contact with a tangent of its own choice.
    pub fn new(point: Vec3, normal: Vec3, model: ContactModel, friction: f64, arm: f64) -> Self {
        let normal = normal.normalize();
        Contact { point, normal, tangent: tangent(normal), model, friction, arm }
    }

    /// The axes n, t, o.
    pub fn axes(&self) -> [Vec3; 3] {
        [self.normal, self.tangent, self.normal.cross(self.tangent)]
    }
}

/// A contact on a link, fixed to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkContact {
    /// Index of the link.
    pub link: usize,
    /// The contact in the frame of the URDF link.
    pub in_link: Contact,
}

/// A contact that is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BadContact {
    /// No such link.
    #[error("contact {index}: the hand has {links} links, none with index {link}")]
    Link {
        /// Number of the contact, from 0.
        index: usize,
        /// The index.
        link: usize,
        /// Number of links.
        links: usize,
    },
    /// A number that is not finite, or a direction of length zero.
    #[error("contact {index}: {what} must be finite{also}")]
    Number {
        /// Number of the contact, from 0.
        index: usize,
        /// Its part.
        what: &'static str,
        /// Further condition.
        also: &'static str,
    },
}

impl LinkContact {
    /// The contact in the world, for the hand in this configuration.
    pub fn placed(&self, hand: &Hand, kin: &Kinematics) -> Contact {
        let pose = own_frame(hand, kin, self.link);
        Contact {
            point: pose.transform_point(self.in_link.point),
            normal: pose.rotation * self.in_link.normal,
            tangent: pose.rotation * self.in_link.tangent,
            ..self.in_link
        }
    }

    /// The contact that is at this place of the world now, fixed to a link.
    pub fn fixed_to(link: usize, world: &Contact, hand: &Hand, kin: &Kinematics) -> Self {
        let inverse = own_frame(hand, kin, link).inverse();
        let in_link = Contact {
            point: inverse.transform_point(world.point),
            normal: inverse.rotation * world.normal,
            tangent: inverse.rotation * world.tangent,
            ..*world
        };
        LinkContact { link, in_link }
    }
}

/// Checks contacts on a hand.
///
/// # Errors
/// The first contact that is not on the hand, or has numbers that are not valid.
pub fn check(hand: &Hand, contacts: &[LinkContact]) -> Result<(), BadContact> {
    for (index, contact) in contacts.iter().enumerate() {
        let links = hand.links.len();
        if contact.link >= links {
            return Err(BadContact::Link { index, link: contact.link, links });
        }
        check_numbers(index, &contact.in_link)?;
    }
    Ok(())
}

/// Checks the numbers of a contact.
///
/// # Errors
/// A part that is not valid.
pub fn check_numbers(index: usize, contact: &Contact) -> Result<(), BadContact> {
    let bad = |what, also| Err(BadContact::Number { index, what, also });
    if !contact.point.is_finite() {
        return bad("its point", "");
    }
    if !contact.axes().iter().all(|axis| axis.is_finite() && (axis.length() - 1.0).abs() < 1e-9) {
        return bad("its normal and tangent", ", not zero and orthogonal");
    }
    if !(contact.friction.is_finite() && contact.friction >= 0.0) {
        return bad("its friction", " and not negative");
    }
    if !(contact.arm.is_finite() && contact.arm >= 0.0) {
        return bad("its arm", " and not negative");
    }
    Ok(())
}

/// First component of each contact in λ.
pub fn first_components(contacts: &[Contact]) -> impl Iterator<Item = usize> {
    contacts.iter().scan(0, |end, contact| {
        let first = *end;
        *end += contact.model.components();
        Some(first)
    })
}

/// A unit vector orthogonal to `normal`: the part of the axis that is farthest from it.
pub fn tangent(normal: Vec3) -> Vec3 {
    let [x, y, z] = normal.to_array().map(f64::abs);
    let axis = if x <= y && x <= z {
        Vec3::X
    } else if y <= z {
        Vec3::Y
    } else {
        Vec3::Z
    };
    (axis - normal * normal.dot(axis)).normalize()
}
