//! Which shapes may touch, and where: broad phase, narrow phase by parry, and the memory of stiction.

pub mod anchor;
pub mod broad;
pub mod cascade;
pub mod impact;
pub mod narrow;
pub mod near;
pub mod touch;
