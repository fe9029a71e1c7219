//! Actuation of the hand: base servo, motors and tendons.

pub mod base;
pub mod motor;
pub mod tendon;
