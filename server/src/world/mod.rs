//! Worlds: runs that are being played, in lockstep or by the clock, and their observers.

pub(crate) mod backlog;
pub(crate) mod images;
pub(crate) mod realtime;
pub(crate) mod run;
pub(crate) mod run_observer;
#[cfg(test)]
mod schedules;
#[cfg(test)]
pub(crate) mod stub;
mod sync;

pub(crate) use run_observer::{RunObserver, Ticked};
