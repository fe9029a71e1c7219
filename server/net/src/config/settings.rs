//! Limits and timeouts of connections and worlds.

use std::time::Duration;

/// Largest message from a client, bytes.
pub const MESSAGE_BYTES: usize = 64 << 10;
/// Largest `repeat` of a step.
pub const MAX_REPEAT: u32 = 100;

/// Limits and timeouts that the organizer sets.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Max open worlds.
    pub max_worlds: usize,
    /// Max control connections.
    pub max_connections: usize,
    /// Max control connections of one team.
    pub max_connections_per_team: usize,
    /// Max sockets of any kind from one address other than this machine's.
    pub max_connections_per_address: usize,
    /// Longest time of a control connection before its hello.
    pub hello_timeout: Duration,
    /// Max requests per second of a connection.
    pub requests_per_s: f64,
    /// Time for which a session waits for its client to reconnect.
    pub resume_grace: Duration,
    /// Time after which a connection that is silent, or does not accept a message, is dropped.
    pub ping_timeout: Duration,
}

impl Settings {
    /// Period of pings: a third of the timeout.
    pub fn ping_interval(&self) -> Duration {
        self.ping_timeout / 3
    }
}
