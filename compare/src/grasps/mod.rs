//! Counts of the [trials](crate::trials) that each engine keeps, at several steps.

pub mod command;
mod page;
pub mod runner;
pub(crate) mod table;
pub mod tally;
mod trace;
