//! The low-latency path: what makes a lockstep call take less time beside the physics. It is three pieces, of which
//! each can be turned off, measured and deleted alone, by setting its line to `false`:
//!
//! - [`pieces::BUSY_POLL`]: a connection looks for its next request before it puts its thread to sleep
//!   (`busy_poll.rs`).
//! - [`pieces::DIRECT_READ`]: while it does, it asks the system itself and is not registered for waking
//!   (`stream.rs`).
//! - [`pieces::LOCAL_SOCKET`]: clients on the same machine are offered a Unix socket (`local.rs`).
//!
//! The rest of the program knows a [`Listener`](listener::Listener), a [`Link`](link::Link) for each connection, and a
//! [`BusyPoll`](busy_poll::BusyPoll). Without all of it: in `app/serve.rs`, hand the TCP listener itself to `serve`, or
//! to `axum::serve`, instead of `Listener::new(tcp)`.

mod attention;
pub(crate) mod busy_poll;
pub(crate) mod link;
pub(crate) mod listener;
mod local;
mod pieces;
mod stream;
