//! Who is let in, and how much may be sent in.

use super::body::Bodies;
use super::connections::Connections;
use super::guard::Guard;
use super::socket_limits::SocketLimits;
use crate::config::settings::Settings;

/// All that is looked at before anybody is answered.
#[derive(Debug)]
pub(crate) struct InboundLimits {
    /// Which pages may use the server.
    pub(crate) guard: Guard,
    /// Open sockets.
    pub(crate) sockets: SocketLimits,
    /// Open control connections.
    pub(crate) connections: Connections,
    /// What is being sent in.
    pub(crate) bodies: Bodies,
}

impl InboundLimits {
    /// As an organizer set it.
    pub(crate) fn new(settings: &Settings, guard: Guard) -> Self {
        InboundLimits {
            guard,
            sockets: SocketLimits::new(settings.max_connections, settings.max_connections_per_address),
            connections: Connections::new(settings),
            bodies: Bodies::default(),
        }
    }
}
