//! Computing time: permits for ticks, threads that begin realtime ticks, jobs in the background, and how many worlds fit.

pub mod admission;
pub mod background;
mod load;
pub mod open_worlds;
pub mod overrun;
pub mod pace;
pub mod pacer;
mod pausable_clock;
pub mod queue;
pub mod resources;
pub mod scheduler;
pub mod tick_phase;

pub use background::{Background, JobPriority, STACK_BYTES};
pub use resources::Compute;
