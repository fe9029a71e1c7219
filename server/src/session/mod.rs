//! Sessions of teams, with their clocks and runs.
//!
//! [`machine`] and [`palmares_worlds::clock`] decide what a session may do; they use neither sockets nor worlds. [`Session`] carries it out. A
//! session belongs to the thread of its connection. While its client is away, it belongs to a task that waits for the client (see
//! [`waiting`]) and computes nothing.

mod adopt;
mod after_run;
mod answered;
mod begin;
mod clock_rows;
mod command;
mod continued;
mod elsewhere;
mod entry;
mod everybody;
mod execute;
mod failure;
mod finish;
mod finished;
mod lost_replay;
mod machine;
mod open_run;
mod refunds;
mod registry;
#[cfg(test)]
mod registry_tests;
mod run;
mod run_inputs;
mod saving;
#[cfg(test)]
mod schedules;
#[expect(clippy::module_inception, reason = "the folder is about sessions, the file about one")]
mod session;
mod slot;
mod sync;
mod waiting;

pub(crate) use command::{Command, PendingCommand};
pub(crate) use entry::practice_team;
pub(crate) use session::{Handover, InboxMessage, Session, Sessions};
pub(crate) use waiting::changed;
