//! Statics: equilibria of a hand without stepping it.

pub mod equilibrium;
pub mod held;
pub mod prediction;
