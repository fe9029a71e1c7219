//! Sessions: a team's visit, its clock, its runs.
//!
//! What may happen when is decided by [`machine`] and [`clock`], which know neither sockets nor worlds;
//! [`Session`] carries it out. A session belongs to the thread of its connection; while its client is away, to a
//! task that waits for it (see [`registry`]) and computes nothing.

mod admission;
mod background;
mod clock;
mod driver;
mod ending;
mod host;
mod live;
mod load;
mod machine;
mod official;
mod orders;
mod overrun;
mod pace;
mod pacer;
mod play;
mod record;
mod refunds;
mod registry;
mod scheduler;
mod tick_phase;
mod world;

pub(crate) use background::{Background, Level, STACK};
pub(crate) use driver::Session;
pub(crate) use host::{Alive, Host, MESSAGE_BYTES, Seat, Settings};
pub(crate) use official::practice_team;
pub(crate) use orders::{Order, Ordered};
pub(crate) use overrun::watch_over;
pub(crate) use refunds::{give_back, give_back_all};
pub(crate) use registry::news;
pub(crate) use world::Witness;
