//! The comparison of engines over scenes and steps.

pub mod claims;
pub mod comparison;
pub mod dominance;
mod front_figure;
mod front_table;
mod job;
mod judgement;
mod outcome_cache;
mod page;
mod passes;
mod peer_result;
pub(crate) mod plots;
pub mod runner;
mod sentinels;
pub mod ticks;

pub use comparison::Comparison;
pub use runner::{ComparisonOptions, write};
