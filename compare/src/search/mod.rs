//! A search over the documented options of the peers: which sets of options solve a scene.
//!
//! `halving.rs` is the search itself. Its result is the file of its plays, so that a second one plays only what is new.

pub mod command;
mod halving;
mod kept;
mod page;
mod player;
mod plays;
mod score;
pub mod table;
#[cfg(test)]
mod tests;
