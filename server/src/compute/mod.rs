//! Computing time: permits for ticks, threads that begin realtime ticks, jobs in the background, and how many worlds fit.

pub(crate) mod admission;
pub(crate) mod background;
mod load;
pub(crate) mod open_worlds;
pub(crate) mod overrun;
pub(crate) mod pace;
pub(crate) mod pacer;
mod pausable_clock;
pub(crate) mod queue;
pub(crate) mod resources;
pub(crate) mod scheduler;
pub(crate) mod tick_phase;

pub(crate) use background::{Background, JobPriority, STACK_BYTES};
pub(crate) use resources::Compute;
