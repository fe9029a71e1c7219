//! What moves the hand: the base servo, motors and tendons.

pub mod base;
pub mod motor;
pub mod tendon;
