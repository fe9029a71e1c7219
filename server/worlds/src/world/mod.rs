//! Worlds: runs that are being played, in lockstep or by the clock, and their observers.

pub mod backlog;
pub mod images;
pub mod realtime;
pub mod run;
pub mod run_observer;
#[cfg(test)]
mod schedules;
#[cfg(test)]
mod stub;
mod sync;

pub use run_observer::{RunObserver, Ticked};
