//! Sessions: a team's visit, its clock, its runs.
//!
//! What may happen when is decided by [`machine`] and [`clock`], which know neither sockets nor worlds;
//! [`Session`] carries it out. A session belongs to the task of its connection; while its client is away, to a
//! task that waits for it (see [`registry`]).

mod clock;
mod driver;
mod host;
mod machine;
mod registry;
mod world;

pub(crate) use driver::Session;
pub(crate) use host::{Host, MESSAGE_BYTES, PING_INTERVAL, PING_TIMEOUT, Settings};
