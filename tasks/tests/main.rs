//! Tests of whole runs. One program: the crates below are linked once, and its tests run side by side.

mod absurd;
mod again;
mod arm;
mod ground;
mod own;
mod pushed;
mod referee;
mod reflex;
mod scenes;
mod senses;
mod snapshot;
mod start;
mod training;
