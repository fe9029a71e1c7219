//! Who calls.

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
    pub(super) link: Link,
    _permit: Arc<SocketPermit>,
}

impl Caller {
    pub(super) fn new(from: Origin, permit: SocketPermit) -> Self {
        let Origin { address, link } = from;
        Caller { address, link, _permit: Arc::new(permit) }
    }
}

/// Where a connection comes from.
pub(crate) struct Origin {
    pub(super) address: IpAddr,
    link: Link,
}

impl From<(SocketAddr, Link)> for Origin {
    fn from((address, link): (SocketAddr, Link)) -> Self {
        Origin { address: address.ip().to_canonical(), link }
    }
}

/// One without the low-latency path.
impl From<SocketAddr> for Origin {
    fn from(address: SocketAddr) -> Self {
        Origin::from((address, Link::default()))
    }
}
