//! Speed against error.
//!
//! A case is a scene with a figure of merit: an error against an analytic answer or, without one, against the
//! same scene at a step of 0.02 ms. The report also has invariants that any run must keep.
//!
//! | part | content |
//! |---|---|
//! | `bench/src/cases/`, `bench/src/rigs.rs` | the cases, by name; small hands for cases with textbook answers |
//! | `bench/src/gates/` | the bounds that a case must keep, in tests; one file for each subject |
//! | `bench/src/engine/` | the interface to an engine, and our engine |
//! | `bench/src/robust/` | random scenes, and one scene in many placements |
//! | `bench/src/sweep/` | a case at many steps beside its bound |
//! | `bench/src/hard_cases/` | hard cases at ten steps from many starts, beside other engines |
//! | `bench/src/study/` | what a scene needs: its parts, its laws, and what is worse without each |
//! | `bench/src/run_log.rs` | finished runs in a file |
//! | `bench/src/record/` | of which engine, models, machine and day a measured page is |

pub mod audit;
pub mod case_report;
pub mod cases;
pub mod command;
pub mod energy;
pub mod engine;
#[cfg(test)]
mod gates;
pub mod hard_cases;
pub mod machine;
pub mod measured;
pub mod monitor;
pub mod overlap;
pub mod random;
pub mod record;
pub mod recorder;
pub mod rigs;
pub mod robust;
mod rolling_disc;
pub mod run_log;
#[cfg(test)]
mod steady;
pub mod study;
pub mod sweep;
