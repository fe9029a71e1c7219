//! Cameras. A z-buffer in 64 bits, on one thread, gives the same image on every machine.
//!
//! [`Geometry`] divides bodies into primitives that a ray meets in closed form, once per run: flat faces, spheres, capsules,
//! cylinders. A rounded box or hull is its faces, moved outwards by the rounding, and a capsule along each edge. [`draw`]
//! writes the nearest primitive of every pixel to a [`GBuffer`]. [`shade`] makes colours of it, [`plain_depth`] exact depth,
//! [`stereo_depth`] depth with the errors of a stereo camera. A [`Film`] is for people: shadows, smooth edges. A [`CameraSensor`] has the times of its images.

mod canvas;
mod draw;
mod face;
mod film;
mod gbuffer;
mod geometry;
mod intrinsics;
mod round;
mod sensor;
mod shade;
mod stereo;

pub use draw::draw;
pub use film::{Film, Light};
pub use gbuffer::GBuffer;
pub use geometry::{Body, Geometry};
pub use intrinsics::Intrinsics;
pub use sensor::CameraSensor;
pub use shade::shade;
pub use stereo::{plain_depth, stereo_depth};
