//! Cameras: what they see is drawn into a z-buffer, in 64 bits and on one thread, the same on every machine.
//!
//! [`Geometry`] takes bodies apart into pieces with a closed form once per run: flat faces, spheres, capsules, cylinders.
//! A rounded box or hull is its faces, moved outwards by the rounding, and a capsule along each edge. [`draw`] keeps of
//! every pixel the nearest piece; [`shade`] colours the picture, [`stereo_depth`] gives depth the errors of a real camera.

mod canvas;
mod draw;
mod face;
mod gbuffer;
mod geometry;
mod intrinsics;
mod round;
mod shade;
mod stereo;

pub use draw::draw;
pub use gbuffer::GBuffer;
pub use geometry::{Body, Geometry};
pub use intrinsics::Intrinsics;
pub use shade::shade;
pub use stereo::{plain_depth, stereo_depth};
