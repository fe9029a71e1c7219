//! Sessions: a team's visit, its clock, its runs.
//!
//! What may happen when is decided by [`machine`] and [`clock`], which know neither sockets nor worlds;
//! [`Session`] carries it out. A session belongs to the task of its connection; while its client is away, to a
//! task that waits for it (see [`registry`]).

mod background;
mod clock;
mod driver;
mod host;
#[allow(dead_code, reason = "for worlds that follow the wall clock")]
mod load;
mod machine;
mod registry;
#[allow(dead_code, reason = "for worlds that follow the wall clock")]
mod scheduler;
mod world;

pub(crate) use background::STACK;

pub(crate) use driver::Session;
pub(crate) use host::{Host, MESSAGE_BYTES, PING_INTERVAL, PING_TIMEOUT, Settings};
pub(crate) use world::Witness;
