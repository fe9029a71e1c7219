//! Spectators: runs as they are played, sent to viewers.
//!
//! A run publishes into its [`Channel`](channel::Channel). The newest frame replaces the one before, so that a slow viewer skips
//! frames. Messages that must not be skipped go through a bounded queue, and a viewer that falls behind there is closed. A world
//! never waits for a viewer: it publishes samples of its state, ten a second without viewers, and other threads make frames of
//! them, once for all viewers.

mod access;
mod binary;
mod channel;
mod context;
mod frame;
mod handshake;
mod hub;
mod link;
pub(crate) mod messages;
mod other_hosts;
mod places;
mod ranking_cache;
mod relay;
pub(crate) mod request;
mod sample;
mod viewer;

pub(crate) use context::WatchContext;
pub(crate) use handshake::watch;
pub(crate) use hub::Hub;
pub(crate) use link::FleetKey;
pub(crate) use other_hosts::OtherHosts;
pub(crate) use ranking_cache::RankingCache;
pub(crate) use relay::relay;

/// Whether a text frame is a request.
pub(crate) fn is_request(text: &str) -> bool {
    request::parse(text).1.is_ok()
}
