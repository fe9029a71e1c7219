//! Tags, attributes and numbers of OpenRAVE's XML, in whose names capitals do not count.

use palmares_models::{Mat3, Pose, Rotation, Vec3};

use super::super::element::{Element, Notes};
use super::super::klampt::rotation::{columns, rotation};
use super::super::reading::Reading;
use crate::numbers::numbers;

pub(super) fn is_tag(element: &Element, tag: &str) -> bool {
    element.name.eq_ignore_ascii_case(tag)
}

/// An attribute, in whose name capitals do not count.
pub(super) fn attribute<'a>(element: &'a Element, name: &str) -> Option<&'a str> {
    let found = element.attributes.iter().find(|(key, _)| key.eq_ignore_ascii_case(name));
    found.map(|(_, value)| value.as_str())
}

/// The first child with this tag.
pub(super) fn child<'a>(element: &'a Element, tag: &str) -> Option<&'a Element> {
    element.children.iter().find(|child| is_tag(child, tag))
}

/// The `N` numbers in an element's text; anything else is a problem.
pub(super) fn list<const N: usize>(element: &Element, reading: &mut Reading<'_>) -> Option<[f64; N]> {
    let list = numbers(&element.text).and_then(|found| <[f64; N]>::try_from(found).ok());
    if list.is_none() {
        let shown: String = element.text.chars().take(40).collect();
        reading.log.bad(element, format!("is '{shown}'; valid: {N} finite numbers; not read"));
    }
    list
}

pub(super) fn vector(element: &Element, reading: &mut Reading<'_>) -> Option<Vec3> {
    list(element, reading).map(Vec3::from_array)
}

/// The pose that the children of an element state: translations add up, and each rotation follows those before it.
pub(super) fn pose(element: &Element, before: Pose, reading: &mut Reading<'_>) -> Pose {
    let Pose { mut translation, rotation: mut turned } = before;
    for child in &element.children {
        let turn = match child.name.to_ascii_lowercase().as_str() {
            "translation" => {
                translation += vector(child, reading).unwrap_or(Vec3::ZERO);
                None
            }
            "rotationmat" => list::<9>(child, reading).and_then(|rows| {
                let found = rotation(columns(&rows));
                if found.is_none() {
                    reading.log.bad(child, "is no rotation; not read");
                }
                found
            }),
            "rotationaxis" => list::<4>(child, reading).and_then(|[x, y, z, degrees]| {
                let axis = Vec3::new(x, y, z).try_normalize()?;
                Some(Rotation::from_axis_angle(axis, degrees.to_radians()))
            }),
            // The real part comes first.
            "quat" => list::<4>(child, reading)
                .filter(|q| q.iter().any(|x| *x != 0.0))
                .map(|[w, x, y, z]| Rotation::from_xyzw(x, y, z, w).normalize()),
            _ => None,
        };
        turned = turn.map_or(turned, |turn| turn * turned);
    }
    Pose::from_parts(translation, turned)
}

/// A matrix by its rows.
pub(super) fn matrix(rows: [f64; 9]) -> Mat3 {
    let [x, y, z] = columns(&rows);
    Mat3::from_cols(x, y, z)
}
