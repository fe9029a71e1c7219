//! Sessions: a team's visit, its clock, its runs.
//!
//! What may happen when is decided by [`machine`] and [`crate::clock`], which know neither sockets nor worlds;
//! [`Session`] carries it out. A session belongs to the thread of its connection; while its client is away, to a
//! task that waits for it (see [`waiting`]) and computes nothing.

mod begin;
mod command;
mod entry;
mod failure;
mod finish;
mod finished;
mod machine;
mod obey;
mod origin;
mod refunds;
mod registry;
mod run;
#[expect(clippy::module_inception, reason = "the folder is about sessions, the file about one")]
mod session;
mod waiting;

pub(crate) use command::{Command, PendingCommand};
pub(crate) use entry::practice_team;
pub(crate) use session::{Session, Sessions};
pub(crate) use waiting::news;
