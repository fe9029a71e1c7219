//! Who calls.

use super::low_latency::busy_poll::BusyPoll;
use super::low_latency::listener::Link;
use super::socket_limits::SocketPermit;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

/// What is known of whoever opened a connection. Its socket counts as open as long as somebody has this: who takes a socket
/// over from HTTP keeps it.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    /// Where it calls from.
    pub(crate) address: IpAddr,
    /// Its end of the low-latency path.
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

/// The other end of a socket, before it is counted.
pub(crate) struct Peer {
    pub(super) address: IpAddr,
    link: Link,
}

impl From<(SocketAddr, Link)> for Peer {
    fn from((address, link): (SocketAddr, Link)) -> Self {
        Peer { address: address.ip().to_canonical(), link }
    }
}

/// One without the low-latency path.
impl From<SocketAddr> for Peer {
    fn from(address: SocketAddr) -> Self {
        Peer::from((address, Link::default()))
    }
}
