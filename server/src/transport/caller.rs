//! Who calls.

use super::low_latency::link::Link;
use std::net::{IpAddr, SocketAddr};

/// What is known of whoever opened a connection.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    /// Where it calls from; none through the local socket.
    pub(crate) address: Option<IpAddr>,
    /// Its end of the low-latency path.
    pub(super) link: Link,
}

impl From<(Option<SocketAddr>, Link)> for Caller {
    fn from((address, link): (Option<SocketAddr>, Link)) -> Self {
        Caller { address: address.map(|address| address.ip().to_canonical()), link }
    }
}

/// A caller through an ordinary socket.
impl From<SocketAddr> for Caller {
    fn from(address: SocketAddr) -> Self {
        Caller::from((Some(address), Link::default()))
    }
}
