//! An arm that carries the hand: where its joints must be for the base to be somewhere, and how far they come in a tick.
//!
//! `inverse.rs` solves for the joints, `motion.rs` bounds their motion. The arm's drives are ideal: it has no mass, no elasticity and
//! no shape. The base follows it by its servo ([`crate::actuation::base`]).

mod inverse;
mod motion;

pub use inverse::{Reached, distance, place, reach};
pub use motion::{linear_and_angular, towards_joints, towards_pose, towards_twist};
