//! The server's end of a connection. Tokio's TcpStream reports new bytes only after the system has woken a thread of its
//! reactor, which costs a lockstep controller more than a tick. This stream reads the socket directly, and registers it with
//! the reactor only while its reader sleeps.

use std::io::{self, ErrorKind, IoSlice, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::io::unix::AsyncFd;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, ReadBuf};
use tokio::runtime::Handle;
use tokio::sync::Semaphore;
use tokio::time::timeout;

/// Largest single read, bytes.
const READ_BYTES: usize = 16 << 10;
/// Most unread bytes that are discarded before a socket is closed: the close of a socket with unread bytes would discard the
/// answer too.
const MAX_DRAINED: usize = 1 << 20;
/// Longest time that a closed connection waits for the client's end of stream.
const LINGER_TIME: Duration = Duration::from_secs(2);
/// Bounds the closed connections that wait.
static LINGERING: Semaphore = Semaphore::const_new(64);
/// Longest blocking read: afterwards the reader handles other events.
const BLOCK_TIME: Duration = Duration::from_millis(4);

/// How a connection is read.
#[derive(Clone, Debug, Default)]
pub(super) struct PollMode(Arc<AtomicU8>);

/// The reactor wakes the reader.
const REACTOR: u8 = 0;
/// The reader polls.
const SPIN: u8 = 1;
/// The reader blocks its thread in a read.
const BLOCK: u8 = 2;

/// Keeps the mode until it is dropped.
pub(super) struct PollModeGuard<'a>(&'a AtomicU8);

impl PollMode {
    /// A read returns at once, and no waker is registered.
    pub(super) fn spin(&self) -> PollModeGuard<'_> {
        self.set(SPIN)
    }

    /// A read blocks its thread until bytes come, at most [`BLOCK_TIME`].
    pub(super) fn block(&self) -> PollModeGuard<'_> {
        self.set(BLOCK)
    }

    fn set(&self, mode: u8) -> PollModeGuard<'_> {
        self.0.store(mode, Ordering::Release);
        PollModeGuard(&self.0)
    }
}

impl Drop for PollModeGuard<'_> {
    fn drop(&mut self) {
        self.0.store(REACTOR, Ordering::Release);
    }
}

/// A connection; its socket does not block.
#[derive(Debug)]
pub struct Stream {
    /// The socket while it is not registered with the reactor.
    stream: Option<TcpStream>,
    /// The socket while it is registered. It is in one of the two fields.
    registered: Option<AsyncFd<TcpStream>>,
    poll_mode: PollMode,
}

impl Stream {
    /// A stream that is read as `poll_mode` says.
    pub(super) fn new(stream: TcpStream, poll_mode: PollMode) -> Self {
        Stream { stream: Some(stream), registered: None, poll_mode }
    }

    fn stream(&self) -> io::Result<&TcpStream> {
        let registered = self.registered.as_ref().map(AsyncFd::get_ref);
        registered.or(self.stream.as_ref()).ok_or_else(|| ErrorKind::NotConnected.into())
    }

    /// The socket, registered with the reactor.
    fn registered(&mut self) -> io::Result<&AsyncFd<TcpStream>> {
        if let Some(stream) = self.stream.take() {
            // `register` is unsafe; `TcpStream` owns its descriptor, so its contract holds.
            #[expect(
                deprecated,
                reason = "a socket of the standard library upholds what `register` is unsafe for"
            )]
            let registered = AsyncFd::new(stream)?;
            self.registered = Some(registered);
        }
        self.registered.as_ref().ok_or_else(|| ErrorKind::NotConnected.into())
    }

    /// Takes the socket out of the reactor.
    fn deregister(&mut self) {
        if let Some(registered) = self.registered.take() {
            self.stream = Some(registered.into_inner());
        }
    }

    /// Waits for bytes in a blocking read: the shortest way to wake a thread.
    fn read_blocking(&self, room: &mut [u8]) -> io::Result<usize> {
        let mut stream = self.stream()?;
        stream.set_read_timeout(Some(BLOCK_TIME))?;
        stream.set_nonblocking(false)?;
        let read = stream.read(room);
        stream.set_nonblocking(true)?;
        read
    }

    /// Discards bytes that will not be read.
    fn drain(&self) {
        if let Ok(stream) = self.stream() {
            discard(stream);
        }
    }
}

/// Discards the bytes that have come. Returns whether more may come.
fn discard(mut stream: &TcpStream) -> bool {
    let mut scratch = [0; 4096];
    let mut left = MAX_DRAINED;
    loop {
        match stream.read(&mut scratch) {
            Ok(0) => return false,
            Ok(count) => left = left.saturating_sub(count),
            Err(error) => return error.kind() == ErrorKind::WouldBlock,
        }
        if left == 0 {
            return false;
        }
    }
}

/// Discards what still comes until the client closes its side, for a while.
async fn linger(stream: TcpStream) -> io::Result<()> {
    let stream = tokio::net::TcpStream::from_std(stream)?;
    let mut rest = stream.take(MAX_DRAINED as u64);
    let mut nowhere = tokio::io::sink();
    timeout(LINGER_TIME, tokio::io::copy(&mut rest, &mut nowhere)).await??;
    Ok(())
}

impl Drop for Stream {
    /// Closes in order: bytes that come after the close would make the system reset the connection, and the client might lose the
    /// last message.
    fn drop(&mut self) {
        self.deregister();
        let Some(stream) = self.stream.take() else { return };
        if stream.shutdown(Shutdown::Write).is_ok()
            && discard(&stream)
            && let (Ok(runtime), Ok(permit)) = (Handle::try_current(), LINGERING.try_acquire())
        {
            runtime.spawn(async move {
                let _permit = permit;
                let _ = linger(stream).await;
            });
        }
    }
}

impl AsyncRead for Stream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let mode = self.poll_mode.0.load(Ordering::Acquire);
        if mode == REACTOR {
            return self.poll_wake_and_read(context, buffer);
        }
        let room = buffer.remaining().min(READ_BYTES);
        let room = buffer.initialize_unfilled_to(room);
        let read = if mode == BLOCK {
            self.deregister();
            self.read_blocking(room)
        } else {
            self.stream()?.read(room)
        };
        match read {
            Ok(count) => {
                buffer.advance(count);
                Poll::Ready(Ok(()))
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                self.deregister();
                Poll::Pending
            }
            Err(error) => Poll::Ready(Err(error)),
        }
    }
}

impl Stream {
    /// Reads as soon as there are bytes.
    fn poll_wake_and_read(
        &mut self,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let registered = self.registered()?;
        let room = buffer.remaining().min(READ_BYTES);
        loop {
            let mut guard = ready!(registered.poll_read_ready(context))?;
            let read = guard.try_io(|registered| {
                let mut stream = registered.get_ref();
                stream.read(buffer.initialize_unfilled_to(room))
            });
            match read {
                Ok(Ok(count)) => {
                    // Edge-triggered readiness: a short read means that the socket is empty.
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

    /// Writes as soon as the socket has room.
    fn poll_room(
        &mut self,
        context: &mut Context<'_>,
        write: impl Fn(&TcpStream) -> io::Result<usize>,
    ) -> Poll<io::Result<usize>> {
        let registered = self.registered()?;
        loop {
            let mut guard = ready!(registered.poll_write_ready(context))?;
            match guard.try_io(|registered| write(registered.get_ref())) {
                Ok(Err(error)) if error.kind() == ErrorKind::Interrupted => {}
                Ok(done) => return Poll::Ready(done),
                Err(_no_room_yet) => {}
            }
        }
    }
}

/// The result of a write; None when the socket has no room.
fn sent(done: io::Result<usize>) -> Option<io::Result<usize>> {
    match done {
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => None,
        done => Some(done),
    }
}

impl AsyncWrite for Stream {
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
    use std::net::TcpListener;
    use std::time::Duration;
    use tokio::io::AsyncWriteExt;

    fn pair() -> (Stream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let other = TcpStream::connect(listener.local_addr().expect("bound")).expect("it listens");
        let (stream, _) = listener.accept().expect("it waits");
        stream.set_nonblocking(true).expect("possible");
        (Stream::new(stream, PollMode::default()), other)
    }

    #[tokio::test]
    async fn a_sleeping_reader_is_woken_every_time() {
        let (mut stream, mut other) = pair();
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
            stream.read_exact(&mut byte).await.expect("open");
            stream.write_all(&[byte[0] + 1]).await.expect("open");
        }
        talk.join().expect("all answers came");
        assert_eq!(stream.read(&mut byte).await.expect("closed in order"), 0);
    }

    #[tokio::test]
    async fn a_polling_reader_is_not_registered_and_finds_the_bytes() {
        let (mut stream, mut other) = pair();
        let poll_mode = stream.poll_mode.clone();
        let mut byte = [0; 1];
        // Sleeps once, so that there is a registration to remove.
        let slept = tokio::time::timeout(Duration::from_millis(1), stream.read_exact(&mut byte)).await;
        assert!(slept.is_err() && stream.registered.is_some());
        let spinning = poll_mode.spin();
        let mut looks = 0;
        let found = poll_fn(|context| {
            let mut buffer = ReadBuf::new(&mut byte);
            looks += 1;
            if looks == 2 {
                other.write_all(&[7]).expect("open");
                std::thread::sleep(Duration::from_millis(5));
            }
            match Pin::new(&mut stream).poll_read(context, &mut buffer) {
                Poll::Pending => {
                    context.waker().wake_by_ref();
                    Poll::Pending
                }
                Poll::Ready(read) => Poll::Ready(read.map(|()| buffer.filled().to_vec())),
            }
        });
        assert_eq!(found.await.expect("open"), [7]);
        assert!(stream.registered.is_none());
        drop(spinning);
        let later = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(5));
            other.write_all(&[8]).expect("open");
        });
        stream.read_exact(&mut byte).await.expect("asleep again, and woken");
        assert_eq!(byte, [8]);
        later.join().expect("sent");
    }

    #[tokio::test]
    async fn a_blocking_reader_returns_with_the_bytes_or_after_a_while() {
        let (mut stream, mut other) = pair();
        let poll_mode = stream.poll_mode.clone();
        let blocking = poll_mode.block();
        let mut byte = [0; 1];
        let mut look = async || {
            poll_fn(|context| {
                let mut buffer = ReadBuf::new(&mut byte);
                let read = Pin::new(&mut stream).poll_read(context, &mut buffer);
                Poll::Ready(read.map(|read| read.map(|()| buffer.filled().to_vec())))
            })
            .await
        };
        assert!(look().await.is_pending(), "nothing came");
        let later = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(1));
            other.write_all(&[9]).expect("open");
            other
        });
        let found = loop {
            if let Poll::Ready(found) = look().await {
                break found.expect("open");
            }
        };
        assert_eq!(found, [9]);
        drop(blocking);
        let mut other = later.join().expect("sent");
        other.write_all(&[10]).expect("open");
        stream.read_exact(&mut byte).await.expect("woken as ever");
        assert_eq!((byte, stream.registered.is_some()), ([10], true));
    }

    #[tokio::test]
    async fn a_client_that_still_sends_gets_the_last_message_and_no_reset() {
        let (mut stream, mut other) = pair();
        other.write_all(b"unread").expect("open");
        stream.write_all(b"last").await.expect("open");
        drop(stream);
        let client = std::thread::spawn(move || {
            other.write_all(b"more").expect("open");
            std::thread::sleep(Duration::from_millis(20));
            let mut all = Vec::new();
            other.write_all(b"and more").expect("not reset");
            other.read_to_end(&mut all).expect("closed in order");
            all
        });
        assert_eq!(
            tokio::task::spawn_blocking(|| client.join()).await.expect("runs").expect("no reset"),
            b"last"
        );
    }

    #[tokio::test]
    async fn a_full_socket_is_waited_for() {
        let (mut stream, mut other) = pair();
        let bytes = vec![5; 16 << 20];
        let reading = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            let mut all = Vec::new();
            other.read_to_end(&mut all).expect("open to the end");
            all.len()
        });
        stream.write_all(&bytes).await.expect("open");
        stream.shutdown().await.expect("open");
        assert_eq!(reading.join().expect("read"), bytes.len());
    }
}
