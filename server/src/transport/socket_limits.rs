//! How many sockets may be open: all together, and from one address.

use super::counts::{Counts, Share};
use std::io::{self, IoSlice};
use std::net::IpAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Sockets beside those of controllers: viewers, and what asks and goes.
const OTHER_SOCKETS: usize = 512;

/// Counts the open sockets.
#[derive(Debug)]
pub(crate) struct SocketLimits {
    all: Arc<Semaphore>,
    by_address: Counts<IpAddr>,
    per_address: usize,
}

/// A socket that is counted.
#[derive(Debug)]
pub(crate) struct SocketPermit {
    _of_all: OwnedSemaphorePermit,
    _of_address: Option<Share<IpAddr>>,
}

impl SocketLimits {
    /// For so many controllers, and so many sockets of one address.
    pub(crate) fn new(controllers: usize, per_address: usize) -> Self {
        let all = Arc::new(Semaphore::new(controllers + OTHER_SOCKETS));
        SocketLimits { all, by_address: Counts::default(), per_address }
    }

    /// Counts a socket from an address; none when there are enough. From this machine, where also a proxy may be, only
    /// all of them are counted.
    pub(crate) fn enter(&self, from: IpAddr) -> Option<SocketPermit> {
        let of_all = self.all.clone().try_acquire_owned().ok()?;
        let address = from.to_canonical();
        let of_address = match Some(address).filter(|address| !address.is_loopback()) {
            Some(address) => {
                let mut share = self.by_address.share(address);
                share.grow(1, self.per_address).then_some(Some(share))?
            }
            None => None,
        };
        Some(SocketPermit { _of_all: of_all, _of_address: of_address })
    }
}

/// A socket that is counted as long as it exists, also after an upgrade.
#[derive(Debug)]
pub(super) struct Counted<Io> {
    pub(super) io: Io,
    pub(super) _permit: SocketPermit,
}

impl<Io: AsyncRead + Unpin> AsyncRead for Counted<Io> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_read(context, buffer)
    }
}

impl<Io: AsyncWrite + Unpin> AsyncWrite for Counted<Io> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write(context, bytes)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write_vectored(context, parts)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_its_share_of_the_sockets_and_this_machine_all() {
        let sockets = SocketLimits::new(1, 2);
        let far = IpAddr::from([10, 0, 0, 1]);
        let held = [sockets.enter(far), sockets.enter(far)];
        assert!(held.iter().all(Option::is_some));
        assert!(sockets.enter(far).is_none());
        let same = "::ffff:10.0.0.1".parse().expect("an address");
        assert!(sockets.enter(same).is_none(), "the same in another notation");
        assert!(sockets.enter(IpAddr::from([10, 0, 0, 2])).is_some());
        let near: Vec<_> = (0..9).map(|_| sockets.enter(IpAddr::from([127, 0, 0, 1]))).collect();
        assert!(near.iter().all(Option::is_some));
        drop(held);
        assert!(sockets.enter(far).is_some());
    }
}
