//! Spectators: what happens in the worlds, told to whoever watches.
//!
//! A run publishes into its [`Channel`](hub::Channel): the newest frame replaces the one before, so that a slow viewer
//! skips frames; what must not be skipped goes through a bounded queue, and a viewer that falls behind there is
//! closed. A world never waits for a viewer, and one that nobody watches pays for a frame ten times a second.

mod access;
mod frame;
mod hub;
pub(crate) mod messages;
pub(crate) mod request;
mod viewer;

pub(crate) use hub::Hub;
pub(crate) use viewer::watch;
