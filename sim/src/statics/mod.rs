//! Statics: equilibria of a hand without stepping it.

pub mod band;
pub mod constrained;
pub mod drives;
pub mod energy;
pub mod equilibrium;
pub mod loads;
mod loose;
pub mod prediction;
pub mod rest;
