//! Actuation of the hand: base servo, motors, tendons, springs and pins between its joints, and dry friction.

pub mod base;
pub(crate) mod clutch;
pub mod elastic;
pub mod friction;
pub mod motor;
mod row;
pub(crate) mod slowed;
pub mod tendon;
