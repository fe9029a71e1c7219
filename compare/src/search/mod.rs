//! A search over the documented options of the peers: which sets of options solve a scene.
//!
//! It begins with the named settings, and changes one option at a time of the best set whose changes were not tried yet.

mod climb;
pub mod command;
mod page;
mod plays;
pub mod table;
