//! Accepts connections: from the network, and on the same machine through a socket of its own.

use super::attention::Attention;
use super::busy_poll::Awake;
use super::link::Link;
use super::local::Local;
use super::pieces::LOCAL_SOCKET;
use super::stream::Stream;
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpStream};
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;

/// How long no connection is taken after the system could give none, mostly because it has no file descriptor left.
const PAUSE: Duration = Duration::from_millis(200);

/// Accepts connections.
#[derive(Debug)]
pub(crate) struct Listener {
    tcp: TcpListener,
    local: Option<Local>,
    awake: Arc<Awake>,
}

impl Listener {
    /// Accepts what comes to `tcp`, and on the same machine through a socket of its own.
    pub(crate) fn new(tcp: TcpListener) -> Self {
        let local = LOCAL_SOCKET.then(Local::open).and_then(|local| {
            let failed = |error: &io::Error| tracing::debug!(%error, "no socket for clients on this machine");
            local.inspect_err(failed).ok()
        });
        Listener { tcp, local, awake: Arc::default() }
    }

    /// The next one through the local socket; never, where there is none.
    async fn neighbour(local: Option<&Local>) -> io::Result<TcpStream> {
        let Some(local) = local else { return std::future::pending().await };
        let (stream, _) = local.listener.accept().await?;
        // All that is done with it can be done with a socket of either kind.
        Ok(TcpStream::from(OwnedFd::from(stream.into_std()?)))
    }

    fn connected(&self, stream: TcpStream, local: Option<Arc<str>>) -> (Stream, Link) {
        let attention = Attention::default();
        let stream = Stream::new(stream, attention.clone());
        (stream, Link { attention, local, awake: Some(self.awake.clone()) })
    }
}

impl axum::serve::Listener for Listener {
    type Io = Stream;
    type Addr = (Option<SocketAddr>, Link);

    /// The next connection.
    async fn accept(&mut self) -> (Stream, Self::Addr) {
        loop {
            let accepted = tokio::select! {
                accepted = self.tcp.accept() => accepted,
                neighbour = Self::neighbour(self.local.as_ref()) => match neighbour {
                    Ok(stream) => {
                        let (stream, link) = self.connected(stream, None);
                        return (stream, (None, link));
                    }
                    Err(error) => Err(error),
                },
            };
            let (stream, address) = match accepted {
                Ok(accepted) => accepted,
                // It was given up before it was taken.
                Err(error)
                    if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset) =>
                {
                    continue;
                }
                Err(error) => {
                    tracing::warn!(%error, "no connection can be taken; trying again");
                    tokio::time::sleep(PAUSE).await;
                    continue;
                }
            };
            // Small messages, each waited for: Nagle's algorithm would only hold them back.
            if let Err(error) = stream.set_nodelay(true) {
                tracing::debug!(%error, "no TCP_NODELAY");
            }
            let near = address.ip().to_canonical().is_loopback();
            let local = self.local.as_ref().filter(|_| near).map(|local| local.name.clone());
            match stream.into_std() {
                Ok(stream) => {
                    let (stream, link) = self.connected(stream, local);
                    return (stream, (Some(address), link));
                }
                Err(error) => tracing::warn!(%error, "a connection could not be taken"),
            }
        }
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        Ok((Some(self.tcp.local_addr()?), Link::default()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::serve::Listener as _;
    use std::io::{Read, Write};
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    /// A caller on this machine who comes back through the socket it was told of.
    #[cfg(target_os = "linux")]
    async fn neighbours() -> (Stream, std::os::unix::net::UnixStream) {
        use std::os::linux::net::SocketAddrExt;
        use std::os::unix::net::{SocketAddr, UnixStream};
        let mut listener = Listener::new(TcpListener::bind("127.0.0.1:0").await.expect("a free port"));
        let address = listener.tcp.local_addr().expect("bound");
        let _first = TcpStream::connect(address).expect("it listens");
        let (_, (_, first)) = listener.accept().await;
        let name = first.local.expect("it is on this machine");
        let address = SocketAddr::from_abstract_name(name.as_bytes()).expect("a name");
        let other = UnixStream::connect_addr(&address).expect("it listens there, too");
        let (stream, (address, link)) = listener.accept().await;
        assert!(address.is_none() && link.local.is_none());
        (stream, other)
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn a_neighbour_is_woken_and_waited_for() {
        let (mut stream, mut other) = neighbours().await;
        let bytes = vec![5; 16 << 20];
        let talk = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(5));
            other.write_all(&[7]).expect("open");
            std::thread::sleep(Duration::from_millis(20));
            let mut all = Vec::new();
            other.read_to_end(&mut all).expect("open to the end");
            all.len()
        });
        let mut byte = [0; 1];
        stream.read_exact(&mut byte).await.expect("open");
        assert_eq!(byte, [7]);
        stream.write_all(&bytes).await.expect("open");
        stream.shutdown().await.expect("open");
        assert_eq!(talk.join().expect("read"), bytes.len());
    }
}
