//! Actuation of the hand: base servo, motors, tendons, and springs and pins between its joints.

pub mod base;
pub(crate) mod clutch;
pub mod elastic;
pub mod motor;
mod row;
pub(crate) mod slowed;
pub mod tendon;
