//! Sessions: a team's visit, its clock, its runs.
//!
//! What may happen when is decided by [`machine`] and [`clock`], which know neither sockets nor worlds;
//! [`Session`] carries it out. A session belongs to the thread of its connection; while its client is away, to a
//! task that waits for it (see [`registry`]) and computes nothing.

mod clock;
mod driver;
mod ending;
mod host;
mod machine;
mod official;
mod orders;
mod play;
mod record;
mod refunds;
mod registry;

pub(crate) use driver::Session;
pub(crate) use host::{Alive, Host, MESSAGE_BYTES, Seat, Settings};
pub(crate) use official::practice_team;
pub(crate) use orders::{Order, Ordered};
pub(crate) use refunds::{give_back, give_back_all};
pub(crate) use registry::news;
