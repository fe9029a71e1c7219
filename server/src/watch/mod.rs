//! Spectators: what happens in the worlds, told to whoever watches.
//!
//! A run publishes into its [`Channel`](channel::Channel): the newest frame replaces the one before, so that a slow viewer
//! skips frames; what must not be skipped goes through a bounded queue, and a viewer that falls behind there is
//! closed. A world never waits for a viewer: it leaves copies of itself, ten a second if nobody watches, and frames are made
//! of them elsewhere, once for all viewers.

mod access;
mod binary;
mod channel;
mod context;
mod frame;
mod handshake;
mod hub;
pub(crate) mod messages;
pub(crate) mod request;
mod snapshot;
mod viewer;

pub(crate) use context::WatchContext;
pub(crate) use handshake::watch;
pub(crate) use hub::Hub;
