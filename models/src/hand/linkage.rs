//! Pins that close chains of links, as in a four-bar finger.
//!
//! A hand is a tree. A chain of links that closes is cut at one pin: its two halves are a point on one link and a point on another, and a
//! stiff spring keeps them together. A pin between two links that turn about parallel axes is a hinge: the axes keep the plane.

use super::number::{Bounds, Number, Unstated, numbers};
use crate::Vec3;

/// A pin that joins two points of two links: force `F = −K g − D ġ` for the gap g between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Linkage {
    /// Name, for messages.
    pub name: String,
    /// Indices of the two links.
    pub links: [usize; 2],
    /// Position of the pin in the frame of each link, m.
    pub points: [Vec3; 2],
    /// Its numbers.
    pub numbers: LinkageNumbers,
}

numbers! {
    /// The numbers of a pin.
    numbers LinkageNumbers of Linkage;
    /// Its numbers as far as they are stated. A pin of 1e6 N/m gives way by 0.1 mm at 100 N.
    table StatedLinkage;
    /// An entry of `[linkages]`.
    settings LinkageSettings {
        /// Names of URDF links.
        #[serde(deserialize_with = "crate::exact::array")]
        links: [String; 2] = Number::OF_TABLE,
        /// Position of the pin in each link's frame, m.
        #[serde(deserialize_with = "crate::exact::arrays")]
        points: [[f64; 3]; 2] = Number { unit: "m", ..Number::OF_TABLE },
    }
    /// Stiffness, N/m.
    stiffness: f64 = Number {
        unit: "N/m",
        bounds: Bounds::Positive,
        unstated: Unstated::Is(1e6),
        ..Number::REQUIRED
    },
    /// Damping, N·s/m.
    damping: f64 = Number { unit: "N·s/m", bounds: Bounds::NotNegative, ..Number::ZERO },
}
