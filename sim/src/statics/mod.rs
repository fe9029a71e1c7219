//! Where a hand rests, without stepping it.

pub mod equilibrium;
pub mod prediction;
