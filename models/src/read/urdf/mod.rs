//! The URDF of a hand: its text becomes a checked tree of links and joints (`tree.rs`), which is reduced to
//! the links and coordinates of the hand (`mimic.rs`, `reduce.rs`).

pub(crate) mod link;
mod massless;
mod mimic;
mod numbers;
pub(crate) mod reduce;
pub(crate) mod transmission;
pub(crate) mod tree;
pub(crate) mod xml;
