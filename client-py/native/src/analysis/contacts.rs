//! Contacts as Python passes them, and the contacts of a world.

use super::arrays::{numbers, rows, seven, value_error};
use numpy::PyArray1;
use palmares_analysis::contact::{Contact, ContactModel, LinkContact, check_numbers, tangent};
use palmares_analysis::world::held_object;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_sim::World;
use pyo3::prelude::*;
use pyo3::types::PyDict;

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

fn model(name: &str) -> Option<ContactModel> {
    let all = [ContactModel::Frictionless, ContactModel::HardFinger, ContactModel::SoftFinger];
    all.into_iter().find(|model| word(*model) == name)
}

fn word(model: ContactModel) -> &'static str {
    match model {
        ContactModel::Frictionless => "frictionless",
        ContactModel::HardFinger => "hard_finger",
        ContactModel::SoftFinger => "soft_finger",
    }
}

impl Given {
    /// The contact in the frame in which it is given.
    pub(crate) fn contact(&self, index: usize) -> PyResult<Contact> {
        let model = model(&self.model).ok_or_else(|| {
            let wanted = "\"frictionless\", \"hard_finger\" or \"soft_finger\"";
            value_error(format!("contact {index}: model: found {:?}; wanted {wanted}", self.model))
        })?;
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
        let link = hand.link(&self.link).ok_or_else(|| {
            let names: Vec<&str> = hand.links.iter().map(|link| link.name.as_str()).collect();
            value_error(format!(
                "contact {index}: link: found {:?}; wanted one of {}",
                self.link,
                names.join(", ")
            ))
        })?;
        Ok(LinkContact { link, in_link: self.contact(index)? })
    }
}

/// Contacts in the frame in which they are given.
pub(crate) fn contacts(given: &[Given]) -> PyResult<Vec<Contact>> {
    given.iter().enumerate().map(|(index, given)| given.contact(index)).collect()
}

/// The contacts of a world's hand with an object: arrays, poses, and the posture.
pub(crate) fn held<'py>(py: Python<'py>, world: &World, object: usize) -> PyResult<Bound<'py, PyDict>> {
    let Some(held) = held_object(world, object) else {
        return Err(value_error(format!("object: there is no object {object}")));
    };
    let links = world.model().hand().map(|hand| hand.links.as_slice()).unwrap_or_default();
    let found = PyDict::new(py);
    let contacts = &held.contacts;
    let names: Vec<&str> = contacts.iter().map(|contact| links[contact.link].name.as_str()).collect();
    found.set_item("links", names)?;
    found.set_item("points", rows(py, contacts.iter().map(|c| c.in_link.point.to_array()))?)?;
    found.set_item("normals", rows(py, contacts.iter().map(|c| c.in_link.normal.to_array()))?)?;
    found.set_item("tangents", rows(py, contacts.iter().map(|c| c.in_link.tangent.to_array()))?)?;
    found.set_item("models", contacts.iter().map(|c| word(c.in_link.model)).collect::<Vec<_>>())?;
    found.set_item("frictions", contacts.iter().map(|c| c.in_link.friction).collect::<Vec<_>>())?;
    found.set_item("arms", contacts.iter().map(|c| c.in_link.arm).collect::<Vec<_>>())?;
    found.set_item("forces", rows(py, held.forces.iter().copied())?)?;
    found.set_item("moments", PyArray1::from_slice(py, &held.moments))?;
    found.set_item("base", PyArray1::from_slice(py, &seven(&held.base)))?;
    found.set_item("object", PyArray1::from_slice(py, &seven(&held.object)))?;
    found.set_item("q", PyArray1::from_slice(py, &held.q))?;
    found.set_item("tension", PyArray1::from_slice(py, &held.tension))?;
    Ok(found)
}
