//! Who calls.

use super::low_latency::listener::Link;
use std::net::{IpAddr, SocketAddr};

/// What is known of whoever opened a connection.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    /// Where it calls from.
    pub(crate) address: IpAddr,
    /// Its end of the low-latency path.
    pub(super) link: Link,
}

impl From<(SocketAddr, Link)> for Caller {
    fn from((address, link): (SocketAddr, Link)) -> Self {
        Caller { address: address.ip().to_canonical(), link }
    }
}

/// A caller that came without the low-latency path.
impl From<SocketAddr> for Caller {
    fn from(address: SocketAddr) -> Self {
        Caller::from((address, Link::default()))
    }
}
