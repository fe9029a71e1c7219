//! Speed against error.
//!
//! A case is a scene with a figure of merit: an error against an analytic answer or, where there is none,
//! against the same scene at a step of 0.02 ms. Invariants that any run must keep are reported beside it.

pub mod audit;
pub mod cameras;
pub mod cases;
pub mod child;
pub mod energy;
pub mod engine;
pub mod fingerprint;
#[cfg(test)]
mod gates;
pub mod grasps;
pub mod mjcf;
pub mod overlap;
pub mod random;
pub mod recorder;
pub mod report;
pub mod rigs;
pub mod robust;
#[cfg(test)]
mod steady;
pub mod watch;
