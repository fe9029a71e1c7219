//! Tools for hands: description, closing in the air, trials in the tasks, images. With `compare`, the only crate
//! that draws.
//!
//! `hand-tools/src/decompose/` cuts meshes into convex pieces, for hands and tasks. `hand-tools/src/world.rs` makes tasks of Klamp't's worlds.

mod analyse;
mod check;
mod closure;
mod command;
mod copy;
mod decisions;
pub mod decompose;
mod describe;
mod draw;
mod export;
mod figure;
mod figures;
mod fingers;
mod import;
mod load;
mod outline;
mod progress;
mod push;
mod show;
mod stuck;
pub mod table;
mod trial;
mod view;
mod views;
pub mod world;

pub use command::{HandCommand, print_trials};
pub use figures::figures;
pub use load::LimitsOf;
pub use trial::{Script, script};
pub use views::draw_hand;
