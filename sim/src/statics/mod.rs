//! Where a hand rests, without stepping it.

pub mod equilibrium;
pub mod held;
pub mod prediction;
