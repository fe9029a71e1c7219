//! The schedule of an official competition: the time slots of teams.
//!
//! A slot decides when its team may begin a session. At the first reset it also limits the session's length to the rest of the slot;
//! from then on the session's clock alone counts. So a pause, a wait for a place, a refund or an outage moves the session's end as far
//! as it costs, and nothing else does.

mod check;
mod forecast;
mod import;
mod slots;

pub(crate) use check::warnings;
pub(crate) use forecast::{Forecast, PlayingSession};
pub(crate) use import::{from_csv, moment};
pub(crate) use slots::{Timetable, changed};
