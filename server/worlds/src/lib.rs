//! Worlds of the server: permits for their ticks, lockstep and realtime, and the clock of a session.

pub mod clock;
pub mod compute;
pub mod world;
