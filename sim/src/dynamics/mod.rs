//! Rigid-body dynamics of the hand's tree in generalized coordinates.
//!
//! All spatial quantities of the hand are expressed in world axes about the base origin, so that those of
//! different links add without transformation (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, ch. 2).
//! The hand's generalized velocity is `v = [ṗ_base (3), ω_base (3), q̇ (n)]`.

pub mod crba;
pub mod forward;
pub(crate) mod hand;
pub mod jacobian;
pub mod pattern;
pub mod rnea;
pub mod spatial;
pub mod tree;
