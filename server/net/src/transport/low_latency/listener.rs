//! Accepts connections and sets up the low-latency path of each.

use super::busy_poll::{BusyPoll, SpinLimit};
use super::stream::{PollMode, Stream};
use axum::serve::Listener as Accepts;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::TcpListener;

/// The low-latency path of a connection; the default is none.
#[derive(Clone, Debug, Default)]
pub struct Link {
    poll_mode: PollMode,
    spinning: Option<Arc<SpinLimit>>,
}

impl Link {
    /// How the connection waits for requests, on a machine with this number of cores.
    pub fn busy_poll(self, cores: usize) -> BusyPoll {
        BusyPoll::new(self.poll_mode, self.spinning, cores)
    }
}

/// Accepts connections.
#[derive(Debug)]
pub struct Listener {
    tcp: TcpListener,
    spinning: Arc<SpinLimit>,
}

impl Listener {
    /// Accepts the connections of `tcp`.
    pub fn new(tcp: TcpListener) -> Self {
        Listener { tcp, spinning: Arc::default() }
    }
}

impl Accepts for Listener {
    type Io = Stream;
    type Addr = (SocketAddr, Link);

    /// The next connection.
    async fn accept(&mut self) -> (Stream, Self::Addr) {
        loop {
            let (stream, address) = Accepts::accept(&mut self.tcp).await;
            // The messages are small and awaited: Nagle's algorithm would delay them.
            if let Err(error) = stream.set_nodelay(true) {
                tracing::debug!(%error, "no TCP_NODELAY");
            }
            match stream.into_std() {
                Ok(stream) => {
                    let link = Link { poll_mode: PollMode::default(), spinning: Some(self.spinning.clone()) };
                    return (Stream::new(stream, link.poll_mode.clone()), (address, link));
                }
                Err(error) => tracing::warn!(%error, "a connection cannot be accepted"),
            }
        }
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        Ok((self.tcp.local_addr()?, Link::default()))
    }
}
