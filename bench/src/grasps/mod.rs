//! How many grasps does an engine keep? Lift, hold and shake over objects and placements that were drawn before any engine
//! had seen them, at several steps.

pub mod command;
pub mod family;
mod page;
pub mod play;
pub mod runner;
pub mod scene;
pub(crate) mod table;
pub mod tally;
mod trace;
