//! The server's end of a connection. Tokio's own tells of new bytes only after one of its threads has been woken by
//! the system, which costs a lockstep controller more than a tick computes. This one asks the system directly, and is
//! registered for waking only while somebody sleeps on it.

use super::local::Local;
use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use std::io::{self, ErrorKind, IoSlice, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::os::fd::OwnedFd;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpListener;

/// Most that is read at once, bytes.
const AT_ONCE: usize = 16 << 10;

/// Whether whoever reads from a connection looks for bytes himself and need not be woken.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attention(Arc<AtomicBool>);

/// Whoever holds it polls until he drops it.
pub(super) struct Attentive<'a>(&'a AtomicBool);

impl Attention {
    /// From now on nobody is woken when bytes come.
    pub(super) fn attentive(&self) -> Attentive<'_> {
        self.0.store(true, Ordering::Release);
        Attentive(&self.0)
    }
}

impl Drop for Attentive<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// What a connection says of itself.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    pub(super) attention: Attention,
    /// The socket that this caller may come through instead: he is on the same machine.
    pub(super) local: Option<Arc<str>>,
}

impl Connected<IncomingStream<'_, WireListener>> for Caller {
    fn connect_info(stream: IncomingStream<'_, WireListener>) -> Self {
        let wire = stream.io();
        Caller { attention: wire.attention.clone(), local: wire.local.clone() }
    }
}

/// Accepts connections.
#[derive(Debug)]
pub(crate) struct WireListener {
    tcp: TcpListener,
    local: Option<Local>,
}

impl WireListener {
    /// Accepts what comes to `tcp`, and on the same machine through a socket of its own.
    pub(crate) fn new(tcp: TcpListener) -> Self {
        let local = Local::open();
        let local =
            local.inspect_err(|error| tracing::debug!(%error, "no socket for clients on this machine"));
        WireListener { tcp, local: local.ok() }
    }

    /// The next one through the local socket; never, where there is none.
    async fn neighbour(local: Option<&Local>) -> io::Result<TcpStream> {
        let Some(local) = local else { return std::future::pending().await };
        let (stream, _) = local.listener.accept().await?;
        // All that is done with it can be done with a socket of either kind.
        Ok(TcpStream::from(OwnedFd::from(stream.into_std()?)))
    }
}

impl Listener for WireListener {
    type Io = Wire;
    type Addr = Option<SocketAddr>;

    async fn accept(&mut self) -> (Wire, Option<SocketAddr>) {
        loop {
            let (stream, address) = tokio::select! {
                accepted = Listener::accept(&mut self.tcp) => accepted,
                neighbour = Self::neighbour(self.local.as_ref()) => match neighbour {
                    Ok(stream) => return (Wire::new(stream, None), None),
                    Err(error) => {
                        tracing::warn!(%error, "the local socket takes no more connections");
                        self.local = None;
                        continue;
                    }
                },
            };
            // Small messages, each waited for: Nagle's algorithm would only hold them back.
            if let Err(error) = stream.set_nodelay(true) {
                tracing::debug!(%error, "no TCP_NODELAY");
            }
            let near = address.ip().to_canonical().is_loopback();
            let local = self.local.as_ref().filter(|_| near).map(|local| local.name.clone());
            match stream.into_std() {
                Ok(stream) => return (Wire::new(stream, local), Some(address)),
                Err(error) => tracing::warn!(%error, "a connection could not be taken"),
            }
        }
    }

    fn local_addr(&self) -> io::Result<Option<SocketAddr>> {
        self.tcp.local_addr().map(Some)
    }
}

/// A connection; its socket does not block.
#[derive(Debug)]
pub(crate) struct Wire {
    stream: TcpStream,
    /// The same connection, registered for waking. None while nobody has to be woken.
    bell: Option<tokio::net::TcpStream>,
    attention: Attention,
    local: Option<Arc<str>>,
}

impl Wire {
    fn new(stream: TcpStream, local: Option<Arc<str>>) -> Self {
        Wire { stream, bell: None, attention: Attention::default(), local }
    }

    fn bell(&mut self) -> io::Result<Pin<&mut tokio::net::TcpStream>> {
        let bell = match self.bell.take() {
            Some(bell) => bell,
            None => tokio::net::TcpStream::from_std(self.stream.try_clone()?)?,
        };
        Ok(Pin::new(self.bell.insert(bell)))
    }
}

impl AsyncRead for Wire {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if !self.attention.0.load(Ordering::Acquire) {
            return self.bell()?.poll_read(context, buffer);
        }
        let room = buffer.remaining().min(AT_ONCE);
        match self.stream.read(buffer.initialize_unfilled_to(room)) {
            Ok(count) => {
                buffer.advance(count);
                Poll::Ready(Ok(()))
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                self.bell = None;
                Poll::Pending
            }
            Err(error) => Poll::Ready(Err(error)),
        }
    }
}

/// What was sent, or None when there is no room now.
fn sent(done: io::Result<usize>) -> Option<io::Result<usize>> {
    match done {
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => None,
        done => Some(done),
    }
}

impl AsyncWrite for Wire {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        match sent(self.stream.write(bytes)) {
            Some(done) => Poll::Ready(done),
            None => self.bell()?.poll_write(context, bytes),
        }
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        match sent(self.stream.write_vectored(parts)) {
            Some(done) => Poll::Ready(done),
            None => self.bell()?.poll_write_vectored(context, parts),
        }
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.stream.shutdown(Shutdown::Write) {
            Err(error) if error.kind() != ErrorKind::NotConnected => Poll::Ready(Err(error)),
            _ => Poll::Ready(Ok(())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::future::poll_fn;
    use std::time::Duration;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    async fn pair() -> (Wire, TcpStream) {
        let mut listener = WireListener::new(TcpListener::bind("127.0.0.1:0").await.expect("a free port"));
        let address = listener.local_addr().expect("bound").expect("of TCP");
        let connecting = std::thread::spawn(move || TcpStream::connect(address).expect("it listens"));
        let (wire, _) = listener.accept().await;
        (wire, connecting.join().expect("connected"))
    }

    #[tokio::test]
    async fn a_sleeping_reader_is_woken_every_time() {
        let (mut wire, mut other) = pair().await;
        let talk = std::thread::spawn(move || {
            let mut answer = [0; 1];
            for k in 0..50 {
                std::thread::sleep(Duration::from_millis(u64::from(k % 3)));
                other.write_all(&[k]).expect("open");
                other.read_exact(&mut answer).expect("open");
                assert_eq!(answer, [k + 1]);
            }
        });
        let mut byte = [0; 1];
        for _ in 0..50 {
            wire.read_exact(&mut byte).await.expect("open");
            wire.write_all(&[byte[0] + 1]).await.expect("open");
        }
        talk.join().expect("all answers came");
        assert_eq!(wire.read(&mut byte).await.expect("closed in order"), 0);
    }

    #[tokio::test]
    async fn who_looks_himself_is_not_woken_and_finds_the_bytes() {
        let (mut wire, mut other) = pair().await;
        let attention = wire.attention.clone();
        let mut byte = [0; 1];
        // Asleep once, so that there is a bell to be taken away.
        let slept = tokio::time::timeout(Duration::from_millis(1), wire.read_exact(&mut byte)).await;
        assert!(slept.is_err() && wire.bell.is_some());
        let attentive = attention.attentive();
        let mut looks = 0;
        let found = poll_fn(|context| {
            let mut buffer = ReadBuf::new(&mut byte);
            looks += 1;
            if looks == 2 {
                other.write_all(&[7]).expect("open");
                std::thread::sleep(Duration::from_millis(5));
            }
            match Pin::new(&mut wire).poll_read(context, &mut buffer) {
                Poll::Pending => {
                    context.waker().wake_by_ref();
                    Poll::Pending
                }
                Poll::Ready(read) => Poll::Ready(read.map(|()| buffer.filled().to_vec())),
            }
        });
        assert_eq!(found.await.expect("open"), [7]);
        assert!(wire.bell.is_none());
        drop(attentive);
        let later = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(5));
            other.write_all(&[8]).expect("open");
        });
        wire.read_exact(&mut byte).await.expect("asleep again, and woken");
        assert_eq!(byte, [8]);
        later.join().expect("sent");
    }

    /// A caller on this machine who comes back through the socket he was told of.
    #[cfg(target_os = "linux")]
    async fn neighbours() -> (Wire, std::os::unix::net::UnixStream) {
        use std::os::linux::net::SocketAddrExt;
        use std::os::unix::net::{SocketAddr, UnixStream};
        let mut listener = WireListener::new(TcpListener::bind("127.0.0.1:0").await.expect("a free port"));
        let address = listener.local_addr().expect("bound").expect("of TCP");
        let _first = TcpStream::connect(address).expect("it listens");
        let (first, _) = listener.accept().await;
        let name = first.local.expect("it is on this machine");
        let address = SocketAddr::from_abstract_name(name.as_bytes()).expect("a name");
        let other = UnixStream::connect_addr(&address).expect("it listens there, too");
        let (wire, address) = listener.accept().await;
        assert!(address.is_none() && wire.local.is_none());
        (wire, other)
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn a_neighbour_is_woken_and_waited_for() {
        let (mut wire, mut other) = neighbours().await;
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
        wire.read_exact(&mut byte).await.expect("open");
        assert_eq!(byte, [7]);
        wire.write_all(&bytes).await.expect("open");
        wire.shutdown().await.expect("open");
        assert_eq!(talk.join().expect("read"), bytes.len());
    }

    #[tokio::test]
    async fn a_full_socket_is_waited_for() {
        let (mut wire, mut other) = pair().await;
        let bytes = vec![5; 16 << 20];
        let reading = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            let mut all = Vec::new();
            other.read_to_end(&mut all).expect("open to the end");
            all.len()
        });
        wire.write_all(&bytes).await.expect("open");
        wire.shutdown().await.expect("open");
        assert_eq!(reading.join().expect("read"), bytes.len());
    }
}
