//! What a hand and an object *are*: links, joints, inertia, shapes and the adaptive-synergy transmission.
//!
//! Nothing here moves; [`palmares-sim`](../palmares_sim/index.html) steps what is described here.
//! Units are SI; a pose is written `a_from_b` and maps coordinates in `b` to coordinates in `a`.

pub mod builtin;
pub mod catalogue;
pub mod content;
pub mod error;
pub mod files;
mod geometry;
pub mod hand;
pub mod limits;
pub mod load;
pub mod measure;
pub mod object;
mod rolling;
pub mod rotation;
mod settings;
pub mod shape;
pub mod stl;
mod tactile;
mod transmission;
mod urdf;

#[cfg(test)]
mod tests;

pub use parry3d_f64::math::{Matrix as Mat3, Pose, Rotation, Vector as Vec3};
