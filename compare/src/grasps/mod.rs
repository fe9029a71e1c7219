//! Counts of the [trials](crate::trials) that each engine keeps, at several steps.

pub mod cell;
pub mod command;
mod page;
mod pairs;
mod row;
pub mod run;
pub mod runner;
pub(crate) mod table;
pub mod tally;
mod trace;
