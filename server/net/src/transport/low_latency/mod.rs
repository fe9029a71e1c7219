//! The low-latency path: it shortens the part of a lockstep call that is not physics. It has three pieces. The savings are
//! parts of a call's time, measured on a machine with two cores over whole runs of the two lockstep examples in
//! `client-py/src/palmares/examples`:
//!
//! - Busy poll (`busy_poll.rs`): a connection polls for its next request before its thread sleeps. It saves 28 % in balls and
//!   29 % in shelf.
//! - Direct read (`stream.rs`): a polling connection reads the socket itself and is not registered with the reactor. It saves
//!   6 % in balls and 17 % in shelf.
//! - Blocking read (`stream.rs`): when requests come too late for polling but within a millisecond, the session's thread blocks
//!   in a read of the socket, so that no second thread has to wake it. With it, and with the yield between two ticks in
//!   `world/run.rs`, two environments of gymnasium's `AsyncVectorEnv`, ten ticks a step, make 1.0 to 1.2 times the steps of one
//!   in a plain loop; without, 0.96 to 1.03 times.
//!
//! The rest of the server uses a [`Listener`](listener::Listener), a [`Link`](listener::Link) for each connection, and a
//! [`BusyPoll`](busy_poll::BusyPoll). To switch the path off, pass the TCP listener itself to `serve`, or to `axum::serve`,
//! instead of `Listener::new(tcp)` in `app/serve.rs`.

pub mod busy_poll;
pub mod listener;
mod stream;
