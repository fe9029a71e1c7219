//! The network: who is let in, and what is taken of whom. None of it knows what is asked for.

mod body;
mod counts;
mod guard;

pub(crate) use crate::http::Problem;
pub(crate) use body::{Bodies, Received};
pub(crate) use counts::{Counts, Share};
pub(crate) use guard::{Guard, guard};

use crate::session::Host;
use crate::ws::{Caller, WireListener};
use axum::Router;
use axum::extract::{ConnectInfo, Request};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::net::IpAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::JoinSet;

/// How long the head of a request may take, and how long a connection may wait for its next request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);
/// Largest head of a request, bytes.
const HEAD_BYTES: usize = 64 << 10;
/// Sockets beside those of controllers: viewers, and what asks and goes.
const OTHER_SOCKETS: usize = 512;

/// Counts the open sockets.
#[derive(Debug)]
pub(crate) struct Doors {
    all: Arc<Semaphore>,
    by_address: Counts<IpAddr>,
    per_address: usize,
}

/// A socket that is counted.
#[derive(Debug)]
pub(crate) struct Entry {
    _of_all: OwnedSemaphorePermit,
    _of_address: Option<Share<IpAddr>>,
}

impl Doors {
    /// For so many controllers, and so many sockets of one address.
    pub(crate) fn new(controllers: usize, per_address: usize) -> Self {
        let all = Arc::new(Semaphore::new(controllers + OTHER_SOCKETS));
        Doors { all, by_address: Counts::default(), per_address }
    }

    /// Counts a socket from an address; none when there are enough. From this machine, where also a proxy may be, only
    /// all of them are counted.
    pub(crate) fn enter(&self, from: Option<IpAddr>) -> Option<Entry> {
        let of_all = self.all.clone().try_acquire_owned().ok()?;
        let far = from.map(|address| address.to_canonical()).filter(|address| !address.is_loopback());
        let of_address = match far {
            Some(address) => {
                let mut share = self.by_address.share(address);
                share.grow(1, self.per_address).then_some(Some(share))?
            }
            None => None,
        };
        Some(Entry { _of_all: of_all, _of_address: of_address })
    }
}

/// Serves until the server is to finish, then until all requests were answered.
pub(crate) async fn serve(mut listener: WireListener, router: Router, host: Arc<Host>) {
    let mut open = JoinSet::new();
    let mut stopping = pin!(host.stopping());
    loop {
        let (mut wire, address) = tokio::select! {
            biased;
            () = &mut stopping => break,
            Some(_) = open.join_next(), if !open.is_empty() => continue,
            accepted = listener.accept() => accepted,
        };
        match host.doors.enter(address.map(|address| address.ip())) {
            Some(entry) => wire.entered(entry),
            None => {
                tracing::debug!(?address, "no place for another connection");
                wire.refuse();
                continue;
            }
        }
        let caller = Caller::of(&wire, address);
        let router = router.clone();
        let service = service_fn(move |mut request: Request<Incoming>| {
            request.extensions_mut().insert(ConnectInfo(caller.clone()));
            TowerToHyperService::new(router.clone()).call(request)
        });
        let host = host.clone();
        open.spawn(async move {
            let connection = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(HEAD_TIMEOUT)
                .max_buf_size(HEAD_BYTES)
                .serve_connection(TokioIo::new(wire), service)
                .with_upgrades();
            let mut connection = pin!(connection);
            let ended = tokio::select! {
                ended = connection.as_mut() => ended,
                () = host.stopping() => {
                    connection.as_mut().graceful_shutdown();
                    connection.await
                }
            };
            if let Err(error) = ended {
                tracing::debug!(%error, "connection failed");
            }
        });
    }
    drop(listener);
    while open.join_next().await.is_some() {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_its_share_of_the_sockets_and_this_machine_all() {
        let doors = Doors::new(1, 2);
        let far = Some(IpAddr::from([10, 0, 0, 1]));
        let held = [doors.enter(far), doors.enter(far)];
        assert!(held.iter().all(Option::is_some));
        assert!(doors.enter(far).is_none());
        let same = "::ffff:10.0.0.1".parse().ok();
        assert!(doors.enter(same).is_none(), "the same in another notation");
        assert!(doors.enter(Some(IpAddr::from([10, 0, 0, 2]))).is_some());
        let near: Vec<_> = (0..9).map(|_| doors.enter(Some(IpAddr::from([127, 0, 0, 1])))).collect();
        assert!(near.iter().all(Option::is_some) && doors.enter(None).is_some());
        drop(held);
        assert!(doors.enter(far).is_some());
    }
}
