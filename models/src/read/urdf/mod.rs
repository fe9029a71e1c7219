//! The URDF of a hand: its text becomes links and joints (`elements.rs`), a checked tree (`tree.rs`), and the
//! links and coordinates of the hand (`mimic.rs`, `reduce.rs`).

mod elements;
pub(crate) mod link;
mod massless;
mod mimic;
mod numbers;
pub(crate) mod reduce;
pub(crate) mod transmission;
pub(crate) mod tree;
pub(crate) mod xml;
