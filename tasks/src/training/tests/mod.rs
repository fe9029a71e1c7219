//! Options of runs for learners.

mod action_errors;
mod given;
