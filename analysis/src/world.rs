//! The contacts of a simulated hand with an object, in any state of a world.

use crate::contact::{Contact, ContactModel, LinkContact, tangent};
use palmares_models::Pose;
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::model::pair_friction;
use palmares_sim::surface::spin::SpinLaw;
use palmares_sim::{Owner, World};

/// The contacts of a hand with one object, as the last step left them.
#[derive(Clone, Debug)]
pub struct HeldObject {
    /// Contacts, fixed to their links. Their frames have t along the friction, where there is any.
    pub contacts: Vec<LinkContact>,
    /// Force of each on the object in its frame, N: normal and friction at the same point.
    pub forces: Vec<[f64; 3]>,
    /// Moment of each about its normal, N·m.
    pub moments: Vec<f64>,
    /// Pose of the base.
    pub base: Pose,
    /// Coordinates of the hand.
    pub q: Vec<f64>,
    /// Tensions.
    pub tension: Vec<f64>,
    /// The object's frame: its axes, at its centre of mass.
    pub object: Pose,
}

/// The contacts of the hand with an object in the last step; `None` without a hand or such an object. A contact that resists spin is a soft
/// finger, any other a hard one; friction and arm are those of the simulation.
pub fn held_object(world: &World, object: usize) -> Option<HeldObject> {
    let (model, state) = (world.model(), world.state());
    let hand = model.hand()?;
    let pose = *state.objects.get(object)?;
    let mut kin = Kinematics::default();
    kin.update(hand, state.base, &state.q);
    let (mut contacts, mut forces, mut moments) = (Vec::new(), Vec::new(), Vec::new());
    for contact in world.contact_forces() {
        let (link, sign) = match (contact.a, contact.b) {
            (Owner::Link(link), Owner::Object(other)) if other == object => (link, 1.0),
            (Owner::Object(other), Owner::Link(link)) if other == object => (link, -1.0),
            _ => continue,
        };
        let normal = contact.normal * sign;
        let force = contact.force * sign;
        let moment = contact.torque.dot(normal) * sign;
        let slip = force - normal * force.dot(normal);
        let along = if slip.length() > 1e-9 { slip.normalize() } else { tangent(normal) };
        let [a, b] = [contact.colliders.0, contact.colliders.1].map(|side| &model.colliders()[side as usize]);
        let friction = pair_friction(a, b);
        let spin = SpinLaw::between(&a.spin, &b.spin, friction);
        let placed = Contact {
            point: contact.position,
            normal,
            tangent: along,
            model: if spin.is_some() { ContactModel::SoftFinger } else { ContactModel::HardFinger },
            friction,
            arm: spin.map_or(0.0, |law| law.arm(force.dot(normal).max(0.0))),
        };
        contacts.push(LinkContact::fixed_to(link, &placed, hand, &kin));
        forces.push(placed.axes().map(|axis| axis.dot(force)));
        moments.push(moment);
    }
    let (base, q, tension) = (state.base, state.q.clone(), state.tension.clone());
    Some(HeldObject { contacts, forces, moments, base, q, tension, object: pose })
}
