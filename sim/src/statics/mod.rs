//! Statics: equilibria of a hand without stepping it.

pub mod constrained;
pub mod equilibrium;
pub mod prediction;
