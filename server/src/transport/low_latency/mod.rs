//! The low-latency path: what makes a lockstep call take less time beside the physics. It is three pieces. What each saves of
//! a call's time was measured on a machine with two cores, over whole runs of the two lockstep examples in
//! `client-py/src/palmares/examples`:
//!
//! - Busy poll (`busy_poll.rs`): a connection looks for its next request before it puts its thread to sleep. It saves 28 % in
//!   balls and 29 % in shelf.
//! - Direct read (`stream.rs`): while it looks, it asks the system itself and is not registered for waking. It saves 6 % in
//!   balls and 17 % in shelf.
//! - Doze (`stream.rs`): where staying awake does not pay but the request comes within a millisecond, the session's thread
//!   sleeps on the socket itself, and not until another thread has been woken to wake it. With it, and with the yield between
//!   two ticks in `world/run.rs`, two environments of gymnasium's `AsyncVectorEnv`, ten ticks a step, make 1.0 to 1.2 times the
//!   steps of one in a plain loop; without, 0.96 to 1.03 times.
//!
//! The rest of the program knows a [`Listener`](listener::Listener), a [`Link`](listener::Link) for each connection, and a
//! [`BusyPoll`](busy_poll::BusyPoll). Without all of it: in `app/serve.rs`, hand the TCP listener itself to `serve`, or
//! to `axum::serve`, instead of `Listener::new(tcp)`.

pub(crate) mod busy_poll;
pub(crate) mod listener;
mod stream;
