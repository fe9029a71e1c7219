//! Description of a hand and of objects: links, joints, inertia, shapes and the adaptive-synergy
//! transmission.
//!
//! Nothing here moves; `palmares-sim` steps the models. Units are SI; a pose is written `a_from_b` and maps
//! coordinates in `b` to coordinates in `a`.
//!
//! | part | content |
//! |---|---|
//! | `models/src/hand/` | a hand; `coordinate.rs`, `motor.rs`, `tendon.rs` and others declare its numbers |
//! | `models/src/shape/`, `models/src/object.rs`, `catalogue.rs` | shapes; a free object; the catalogue of everyday objects |
//! | `models/src/read/` | makes them from files that may come from a stranger; `urdf/` reads URDF |
//! | `models/src/measure/` | figures of a hand, and whether they are within a competition's limits |
//! | `models/src/pieces/` | decomposes a mesh into convex pieces |
//! | `models/src/builtin.rs`, `models/hands/`, `models/objects/` | the built-in hands; data of hands and objects, with sources |

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
