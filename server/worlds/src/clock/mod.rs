//! The clocks of sessions: the clock itself, and all of them for spectators and organizers.

mod session_clock;
mod session_clocks;

pub use session_clock::{ClockState, SessionClock, Spent};
pub use session_clocks::{Saving, SessionClocks};
