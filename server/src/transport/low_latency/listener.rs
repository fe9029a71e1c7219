//! Accepts connections, and gives each its end of the low-latency path.

use super::busy_poll::{Awake, BusyPoll};
use super::stream::{Attention, Stream};
use axum::serve::Listener as Accepts;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::TcpListener;

/// What a connection has of it; by default nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Link {
    attention: Attention,
    /// Counts who stays awake.
    awake: Option<Arc<Awake>>,
}

impl Link {
    /// How the connection waits for requests, on a machine with so many cores.
    pub(crate) fn busy_poll(self, cores: usize) -> BusyPoll {
        BusyPoll::new(self.attention, self.awake, cores)
    }
}

/// Accepts connections.
#[derive(Debug)]
pub(crate) struct Listener {
    tcp: TcpListener,
    awake: Arc<Awake>,
}

impl Listener {
    /// Accepts what comes to `tcp`.
    pub(crate) fn new(tcp: TcpListener) -> Self {
        Listener { tcp, awake: Arc::default() }
    }
}

impl Accepts for Listener {
    type Io = Stream;
    type Addr = (SocketAddr, Link);

    /// The next connection.
    async fn accept(&mut self) -> (Stream, Self::Addr) {
        loop {
            let (stream, address) = Accepts::accept(&mut self.tcp).await;
            // Small messages, each waited for: Nagle's algorithm would only hold them back.
            if let Err(error) = stream.set_nodelay(true) {
                tracing::debug!(%error, "no TCP_NODELAY");
            }
            match stream.into_std() {
                Ok(stream) => {
                    let link = Link { attention: Attention::default(), awake: Some(self.awake.clone()) };
                    return (Stream::new(stream, link.attention.clone()), (address, link));
                }
                Err(error) => tracing::warn!(%error, "a connection could not be taken"),
            }
        }
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        Ok((self.tcp.local_addr()?, Link::default()))
    }
}
