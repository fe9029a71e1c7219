//! Description of a hand and of objects: links, joints, inertia, shapes and the adaptive-synergy
//! transmission.
//!
//! [`shape`], [`hand`], [`object`] and [`catalogue`] are the descriptions. [`read`] makes them from files,
//! [`measure`] computes figures of a hand and compares them with a competition's limits, [`pieces`]
//! decomposes a mesh into convex pieces. Nothing here moves; [`palmares-sim`](../palmares_sim/index.html)
//! steps the models. Units are SI; a pose is written `a_from_b` and maps coordinates in `b` to coordinates in
//! `a`.

pub mod arm;
pub mod builtin;
pub mod camera;
pub mod catalogue;
pub mod content;
pub mod error;
mod exact;
pub mod hand;
pub mod measure;
pub mod mjcf;
pub mod object;
pub mod pieces;
pub mod read;
pub mod rotation;
pub mod shape;

#[cfg(test)]
mod tests;

pub use parry3d_f64::math::{Matrix as Mat3, Pose, Rotation, Vector as Vec3};
