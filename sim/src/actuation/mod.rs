//! What moves the hand: the base servo, motors and tendons, and the closed form they are predicted by.

pub mod base;
pub mod equilibrium;
pub mod motor;
pub mod tendon;
