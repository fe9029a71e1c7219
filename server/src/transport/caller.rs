//! The other end of a connection.

use super::low_latency::busy_poll::BusyPoll;
use super::low_latency::listener::Link;
use super::socket_limits::SocketPermit;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

/// The client of a connection. Its socket counts as open until the last clone is dropped: the handler that takes a socket
/// over from HTTP keeps one.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    /// Its address.
    pub(crate) address: IpAddr,
    /// The server's end of the low-latency path.
    link: Link,
    _permit: Arc<SocketPermit>,
}

impl Caller {
    pub(super) fn new(from: Peer, permit: SocketPermit) -> Self {
        let Peer { address, link } = from;
        Caller { address, link, _permit: Arc::new(permit) }
    }

    /// How its connection waits for requests, on a machine with this number of cores.
    pub(crate) fn busy_poll(&self, cores: usize) -> BusyPoll {
        self.link.clone().busy_poll(cores)
    }
}

/// The client of a socket that is not counted yet.
pub(crate) struct Peer {
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
