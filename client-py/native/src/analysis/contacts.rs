//! Contacts as Python passes them, and the contacts of a world.

use super::arrays::{Answer, Part, answer, numbers, place_of, rows, value_error, word};
use palmares_analysis::contact::{Contact, ContactModel, LinkContact, check_numbers, tangent};
use palmares_analysis::world::held_object;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_sim::World;
use pyo3::prelude::*;

/// `palmares.analysis.Contact`
#[derive(FromPyObject)]
pub(crate) struct Given {
    link: String,
    point: [f64; 3],
    normal: [f64; 3],
    tangent: Option<[f64; 3]>,
    model: String,
    friction: f64,
    arm: f64,
}

const MODELS: [(&str, ContactModel); 3] = [
    ("frictionless", ContactModel::Frictionless),
    ("hard_finger", ContactModel::HardFinger),
    ("soft_finger", ContactModel::SoftFinger),
];

impl Given {
    /// The contact in the frame in which it is given.
    pub(crate) fn contact(&self, index: usize) -> PyResult<Contact> {
        let model = word(&format!("contact {index}: model"), &self.model, &MODELS)?;
        numbers(&format!("contact {index}: point"), &self.point, 3)?;
        let normal = Vec3::from_array(self.normal).normalize();
        let tangent = match self.tangent.map(Vec3::from_array) {
            None => tangent(normal),
            Some(along) => (along - normal * normal.dot(along)).normalize(),
        };
        let point = Vec3::from_array(self.point);
        let contact = Contact { point, normal, tangent, model, friction: self.friction, arm: self.arm };
        check_numbers(index, &contact).map_err(value_error)?;
        Ok(contact)
    }

    /// The contact on its link.
    pub(crate) fn on(&self, index: usize, hand: &Hand) -> PyResult<LinkContact> {
        let names = hand.links.iter().map(|link| &link.name);
        let link = place_of(&format!("contact {index}: link"), &self.link, names)?;
        Ok(LinkContact { link, in_link: self.contact(index)? })
    }
}

/// Contacts in the frame in which they are given.
pub(crate) fn contacts(given: &[Given]) -> PyResult<Vec<Contact>> {
    given.iter().enumerate().map(|(index, given)| given.contact(index)).collect()
}

/// The contacts of a world's hand with an object: arrays, poses, and the posture.
pub(crate) fn held<'py>(py: Python<'py>, world: &World, object: usize) -> Answer<'py> {
    let Some(held) = held_object(world, object) else {
        return Err(value_error(format!("object: there is no object {object}")));
    };
    let links = world.model().hand().map(|hand| hand.links.as_slice()).unwrap_or_default();
    let contacts = || held.contacts.iter().map(|contact| &contact.in_link);
    let models = contacts().filter_map(|contact| MODELS.iter().find(|(_, model)| *model == contact.model));
    answer!(
        py,
        "links": held.contacts.iter().map(|contact| &links[contact.link].name).collect::<Vec<_>>(),
        "points": rows(py, contacts().map(|contact| contact.point.to_array()))?,
        "normals": rows(py, contacts().map(|contact| contact.normal.to_array()))?,
        "tangents": rows(py, contacts().map(|contact| contact.tangent.to_array()))?,
        "models": models.map(|(word, _)| *word).collect::<Vec<_>>(),
        "frictions": contacts().map(|contact| contact.friction).collect::<Vec<_>>(),
        "arms": contacts().map(|contact| contact.arm).collect::<Vec<_>>(),
        "forces": rows(py, held.forces.iter().copied())?,
        "moments": held.moments.part(py)?,
        "base": held.base.part(py)?,
        "object": held.object.part(py)?,
        "q": held.q.part(py)?,
        "tension": held.tension.part(py)?,
    )
}
