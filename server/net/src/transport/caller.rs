//! The other end of a connection.

use super::inbound_limits::InboundLimits;
use super::low_latency::busy_poll::BusyPoll;
use super::low_latency::listener::Link;
use super::quota::Quota;
use super::socket_limits::SocketPermit;
use super::trusted_proxies::TrustedProxies;
use axum::http::HeaderMap;
use palmares_protocol::{Code, Refusal};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

/// The client of a connection. Its socket counts as open until the last clone is dropped: the handler that takes a socket
/// over from HTTP keeps one.
#[derive(Clone, Debug)]
pub struct Caller {
    /// Its address.
    pub address: IpAddr,
    /// Whether a trusted proxy named the address.
    forwarded: bool,
    /// Counts a WebSocket that came through a proxy.
    _quota: Option<Arc<Quota<IpAddr>>>,
    /// The server's end of the low-latency path.
    link: Link,
    _permit: Arc<SocketPermit>,
}

impl Caller {
    pub(super) fn new(from: Peer, permit: SocketPermit) -> Self {
        let Peer { address, link } = from;
        Caller { address, forwarded: false, _quota: None, link, _permit: Arc::new(permit) }
    }

    /// The client behind trusted proxies, as the headers of a request name it.
    pub(super) fn behind(self, proxies: &TrustedProxies, headers: &HeaderMap) -> Self {
        let address = proxies.client(self.address, headers);
        Caller { forwarded: address != self.address, address, ..self }
    }

    /// Counts a WebSocket towards the sockets of its client's address, if a trusted proxy opened the connection. Others are counted
    /// when they connect.
    ///
    /// # Errors
    /// The address has too many sockets.
    pub fn counted(self, limits: &InboundLimits) -> Result<Self, Refusal> {
        if !self.forwarded {
            return Ok(self);
        }
        match limits.sockets.of_address(self.address) {
            Some(quota) => Ok(Caller { _quota: quota.map(Arc::new), ..self }),
            None => {
                let message = "too many connections from this address; try again";
                Err(Refusal::new(Code::Capacity, message).retry_after(5.0))
            }
        }
    }

    /// How its connection waits for requests, on a machine with this number of cores.
    pub fn busy_poll(&self, cores: usize) -> BusyPoll {
        self.link.clone().busy_poll(cores)
    }
}

/// The client of a socket that is not counted yet.
pub struct Peer {
    pub(super) address: IpAddr,
    link: Link,
}

impl From<(SocketAddr, Link)> for Peer {
    fn from((address, link): (SocketAddr, Link)) -> Self {
        Peer { address: address.ip().to_canonical(), link }
    }
}

/// A client without the low-latency path.
impl From<SocketAddr> for Peer {
    fn from(address: SocketAddr) -> Self {
        Peer::from((address, Link::default()))
    }
}
