//! Limits and timeouts of connections and worlds.

use std::time::Duration;

/// Largest message from a client, bytes.
pub(crate) const MESSAGE_BYTES: usize = 64 << 10;
/// Largest `repeat` of a step.
pub(crate) const MAX_REPEAT: u32 = 100;

/// Limits and timeouts that the organizer sets.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Max open worlds.
    pub(crate) max_worlds: usize,
    /// Max control connections.
    pub(crate) max_connections: usize,
    /// Max control connections of one team.
    pub(crate) max_connections_per_team: usize,
    /// Max sockets of any kind from one address other than this machine's.
    pub(crate) max_connections_per_address: usize,
    /// Longest time of a control connection before its hello.
    pub(crate) hello_timeout: Duration,
    /// Max requests per second of a connection.
    pub(crate) requests_per_s: f64,
    /// Time for which a session waits for its client to reconnect.
    pub(crate) resume_grace: Duration,
    /// Time after which a connection that is silent, or does not accept a message, is dropped.
    pub(crate) ping_timeout: Duration,
}

impl Settings {
    /// Period of pings: a third of the timeout.
    pub(crate) fn ping_interval(&self) -> Duration {
        self.ping_timeout / 3
    }
}
