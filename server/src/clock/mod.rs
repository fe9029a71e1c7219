//! The clocks of sessions: the clock itself, and all of them for spectators and organizers.

mod session_clock;
mod session_clocks;

pub(crate) use session_clock::{ClockState, SessionClock, Spent};
pub(crate) use session_clocks::{Saving, SessionClocks};
