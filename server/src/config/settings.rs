//! What an organizer sets of connections and worlds, and what is fixed.

use std::time::Duration;

/// Largest inbound message, bytes.
pub(crate) const MESSAGE_BYTES: usize = 64 << 10;
/// Largest `repeat` of a step.
pub(crate) const REPEAT: u32 = 100;

/// What an organizer sets.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Worlds that may be open at once.
    pub(crate) max_worlds: usize,
    /// Control connections that may be open at once.
    pub(crate) max_connections: usize,
    /// Those of one team, by its tokens.
    pub(crate) max_connections_per_team: usize,
    /// Sockets of any kind from one address that is not this machine's.
    pub(crate) max_connections_per_address: usize,
    /// How long a control connection may be open before it has said hello.
    pub(crate) hello_timeout: Duration,
    /// Requests per second that a connection may keep up.
    pub(crate) requests_per_s: f64,
    /// How long a session waits for its client to come back.
    pub(crate) resume_grace: Duration,
    /// A connection that is silent for this long, or does not take a message for this long, is dropped.
    pub(crate) ping_timeout: Duration,
}

impl Settings {
    /// Period of pings: three fit into the timeout.
    pub(crate) fn ping_interval(&self) -> Duration {
        self.ping_timeout / 3
    }
}
