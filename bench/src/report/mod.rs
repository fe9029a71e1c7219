//! What a case prints, and the comparison of engines over scenes and steps.

mod case;
pub mod claims;
pub mod comparison;
pub mod dominance;
pub mod machine;
mod outcome_cache;
mod page;
mod passes;
mod played;
mod plots;
pub mod runner;
pub mod ticks;
mod verdict;

pub use case::{Figure, Invariants, Report, Times};
pub use comparison::Comparison;
pub use played::Played;
pub use runner::{Options, write};
