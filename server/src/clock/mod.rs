//! The clocks of sessions: how one runs, and where everybody who shows one finds it.

mod session_clock;
mod session_clocks;

pub(crate) use session_clock::{ClockState, SessionClock, Spent};
pub(crate) use session_clocks::SessionClocks;
