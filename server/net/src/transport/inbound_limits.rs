//! Which connections are accepted, and how much they may send.

use super::body::Bodies;
use super::connections::Connections;
use super::guard::Guard;
use super::socket_limits::SocketLimits;
use super::trusted_proxies::TrustedProxies;
use crate::config::settings::Settings;

/// The checks that come before a handler.
#[derive(Debug)]
pub struct InboundLimits {
    /// Which pages may use the server.
    pub guard: Guard,
    /// Open sockets.
    pub sockets: SocketLimits,
    /// Open control connections.
    pub connections: Connections,
    /// Request bodies in memory.
    pub bodies: Bodies,
}

impl InboundLimits {
    /// The limits that the organizer sets.
    pub fn new(settings: &Settings, guard: Guard, proxies: TrustedProxies) -> Self {
        let (all, per_address) = (settings.max_connections, settings.max_connections_per_address);
        InboundLimits {
            guard,
            sockets: SocketLimits::new(all, per_address, proxies),
            connections: Connections::new(settings),
            bodies: Bodies::default(),
        }
    }
}
