//! Pins that close chains of links, as in a four-bar finger.
//!
//! A hand is a tree. A chain of links that closes is cut at one pin: its two halves are a point on one link and a point on another, and a
//! stiff spring keeps them together. A pin between two links that turn about parallel axes is a hinge: the axes keep the plane.

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
    /// K, N/m: 1e6 keeps the points within 0.1 mm at 100 N.
    pub stiffness: f64,
    /// D, N·s/m.
    pub damping: f64,
}
