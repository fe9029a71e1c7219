//! Accepts connections, and gives each its end of the low-latency path.

use super::attention::Attention;
use super::busy_poll::Awake;
use super::link::Link;
use super::stream::Stream;
use axum::serve::Listener as Accepts;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::TcpListener;

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
