//! The server's end of a connection. Tokio's own tells of new bytes only after one of its threads has been woken by
//! the system, which costs a lockstep controller more than a tick computes. This one asks the system directly, and is
//! registered for waking only while somebody sleeps on it.

use super::local::Local;
use crate::net::Entry;
use std::io::{self, ErrorKind, IoSlice, Read, Write};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpStream};
use std::os::fd::OwnedFd;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::unix::AsyncFd;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpListener;

/// Most that is read at once, bytes.
const AT_ONCE: usize = 16 << 10;
/// What is thrown away at most of what a caller goes on sending after it was answered, bytes: a socket that is closed with
/// unread bytes takes the answer with it.
const UNREAD: usize = 1 << 20;
/// How long no connection is taken after the system could give none, mostly because it has no file descriptor left.
const PAUSE: Duration = Duration::from_millis(200);

/// What a connection is told for which there is no place.
const FULL: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/problem+json\r\n\
    retry-after: 5\r\nconnection: close\r\ncontent-length: 183\r\n\r\n\
    {\"type\":\"about:blank\",\"title\":\"Service Unavailable\",\"status\":503,\"detail\":\"too many connections \
    from this address, or to this server; try again\",\"code\":\"capacity\",\"retry_after_s\":5.0}";

/// Whether whoever reads from a connection looks for bytes himself and need not be woken.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attention(Arc<AtomicBool>);

/// Whoever holds it polls until it drops it.
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
    /// The socket that this caller may come through instead, on the same machine.
    pub(super) local: Option<Arc<str>>,
    /// Where it calls from; none through the local socket.
    pub(crate) address: Option<IpAddr>,
}

impl Caller {
    /// Who calls through this.
    pub(crate) fn of(wire: &Wire, address: Option<SocketAddr>) -> Self {
        let address = address.map(|address| address.ip().to_canonical());
        Caller { attention: wire.attention.clone(), local: wire.local.clone(), address }
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

    /// The next connection.
    pub(crate) async fn accept(&mut self) -> (Wire, Option<SocketAddr>) {
        loop {
            let accepted = tokio::select! {
                accepted = self.tcp.accept() => accepted,
                neighbour = Self::neighbour(self.local.as_ref()) => match neighbour {
                    Ok(stream) => return (Wire::new(stream, None), None),
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
                Ok(stream) => return (Wire::new(stream, local), Some(address)),
                Err(error) => tracing::warn!(%error, "a connection could not be taken"),
            }
        }
    }

    #[cfg(test)]
    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.tcp.local_addr()
    }
}

/// A connection; its socket does not block.
#[derive(Debug)]
pub(crate) struct Wire {
    /// The connection while nobody has to be woken; ...
    stream: Option<TcpStream>,
    /// ... the same, registered for waking, otherwise. One descriptor in either place.
    bell: Option<AsyncFd<TcpStream>>,
    attention: Attention,
    local: Option<Arc<str>>,
    /// Given back when the connection is gone.
    _entry: Option<Entry>,
}

impl Wire {
    fn new(stream: TcpStream, local: Option<Arc<str>>) -> Self {
        Wire { stream: Some(stream), bell: None, attention: Attention::default(), local, _entry: None }
    }

    /// Counts it.
    pub(crate) fn entered(&mut self, entry: Entry) {
        self._entry = Some(entry);
    }

    /// Says that there is no place, to whoever listens, and closes it.
    pub(crate) fn refuse(self) {
        if let Ok(mut stream) = self.stream() {
            let _ = stream.write(FULL);
            let _ = stream.shutdown(Shutdown::Write);
            self.drain();
        }
    }

    fn stream(&self) -> io::Result<&TcpStream> {
        let registered = self.bell.as_ref().map(AsyncFd::get_ref);
        registered.or(self.stream.as_ref()).ok_or_else(|| ErrorKind::NotConnected.into())
    }

    /// The connection, registered for waking.
    fn bell(&mut self) -> io::Result<&AsyncFd<TcpStream>> {
        if let Some(stream) = self.stream.take() {
            // What it is replaced by is unsafe; of a type that owns its descriptor until it is gone it asks for nothing more.
            #[expect(
                deprecated,
                reason = "a socket of the standard library upholds what `register` is unsafe for"
            )]
            let bell = AsyncFd::new(stream)?;
            self.bell = Some(bell);
        }
        self.bell.as_ref().ok_or_else(|| ErrorKind::NotConnected.into())
    }

    /// From now on nobody has to be woken.
    fn silence(&mut self) {
        if let Some(bell) = self.bell.take() {
            self.stream = Some(bell.into_inner());
        }
    }

    /// Throws away what has come and nobody will read.
    fn drain(&self) {
        let Ok(mut stream) = self.stream() else { return };
        let mut scratch = [0; 4096];
        let mut left = UNREAD;
        while let Ok(count @ 1..) = stream.read(&mut scratch) {
            left = left.saturating_sub(count);
            if left == 0 {
                return;
            }
        }
    }
}

impl AsyncRead for Wire {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if !self.attention.0.load(Ordering::Acquire) {
            return self.poll_wake_and_read(context, buffer);
        }
        let room = buffer.remaining().min(AT_ONCE);
        let mut stream = self.stream()?;
        match stream.read(buffer.initialize_unfilled_to(room)) {
            Ok(count) => {
                buffer.advance(count);
                Poll::Ready(Ok(()))
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                self.silence();
                Poll::Pending
            }
            Err(error) => Poll::Ready(Err(error)),
        }
    }
}

impl Wire {
    /// Reads as soon as there is something.
    fn poll_wake_and_read(
        &mut self,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let bell = self.bell()?;
        let room = buffer.remaining().min(AT_ONCE);
        loop {
            let mut guard = ready!(bell.poll_read_ready(context))?;
            let read = guard.try_io(|bell| {
                let mut stream = bell.get_ref();
                stream.read(buffer.initialize_unfilled_to(room))
            });
            match read {
                Ok(Ok(count)) => {
                    // Where the system tells of what is new only, less than there was room for is all there is.
                    if cfg!(target_os = "linux") && (1..room).contains(&count) {
                        guard.clear_ready();
                    }
                    buffer.advance(count);
                    return Poll::Ready(Ok(()));
                }
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(Err(error)) => return Poll::Ready(Err(error)),
                Err(_nothing_yet) => {}
            }
        }
    }

    /// Writes as soon as there is room.
    fn poll_room(
        &mut self,
        context: &mut Context<'_>,
        write: impl Fn(&TcpStream) -> io::Result<usize>,
    ) -> Poll<io::Result<usize>> {
        let bell = self.bell()?;
        loop {
            let mut guard = ready!(bell.poll_write_ready(context))?;
            match guard.try_io(|bell| write(bell.get_ref())) {
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(done) => return Poll::Ready(done),
                Err(_no_room_yet) => {}
            }
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
        match sent(self.stream()?.write(bytes)) {
            Some(done) => Poll::Ready(done),
            None => self.poll_room(context, |mut stream| stream.write(bytes)),
        }
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        match sent(self.stream()?.write_vectored(parts)) {
            Some(done) => Poll::Ready(done),
            None => self.poll_room(context, |mut stream| stream.write_vectored(parts)),
        }
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.stream()?.shutdown(Shutdown::Write) {
            Err(error) if error.kind() != ErrorKind::NotConnected => Poll::Ready(Err(error)),
            _ => {
                self.drain();
                Poll::Ready(Ok(()))
            }
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
        let address = listener.local_addr().expect("bound");
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

    /// A caller on this machine who comes back through the socket it was told of.
    #[cfg(target_os = "linux")]
    async fn neighbours() -> (Wire, std::os::unix::net::UnixStream) {
        use std::os::linux::net::SocketAddrExt;
        use std::os::unix::net::{SocketAddr, UnixStream};
        let mut listener = WireListener::new(TcpListener::bind("127.0.0.1:0").await.expect("a free port"));
        let address = listener.local_addr().expect("bound");
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

    #[test]
    fn what_a_refused_connection_is_told_is_a_whole_answer() {
        let text = std::str::from_utf8(FULL).expect("text");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head and a body");
        assert!(head.contains(&format!("content-length: {}", body.len())), "{}", body.len());
        let problem: serde_json::Value = serde_json::from_str(body).expect("JSON");
        assert_eq!(problem["code"], "capacity");
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
