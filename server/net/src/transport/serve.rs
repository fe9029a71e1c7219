//! Serves HTTP on any listener.

use super::caller::{Caller, Peer};
use super::inbound_limits::InboundLimits;
use crate::process::lifecycle::Lifecycle;
use axum::Router;
use axum::extract::{ConnectInfo, Request};
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncWrite, AsyncWriteExt};
use tokio::task::JoinSet;
use tokio::time::timeout;

/// Longest time for the head of a request, and longest idle time of a connection between two requests.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);
/// Largest head of a request, bytes.
const HEAD_BYTES: usize = 64 << 10;
/// Longest time to send a refusal to a client whose connection is one too many.
const REFUSAL_TIMEOUT: Duration = Duration::from_secs(1);

/// The answer to a connection that is one too many.
const FULL: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\ncontent-type: application/problem+json\r\n\
    retry-after: 5\r\nconnection: close\r\ncontent-length: 183\r\n\r\n\
    {\"type\":\"about:blank\",\"title\":\"Service Unavailable\",\"status\":503,\"detail\":\"too many connections \
    from this address, or to this server; try again\",\"code\":\"capacity\",\"retry_after_s\":5.0}";

/// Serves until the server stops, then until all requests are answered. `listener` is any listener of `axum::serve`; unlike
/// there, sockets are counted, and a head has bounds of size and time.
pub async fn serve<L>(mut listener: L, router: Router, inbound: Arc<InboundLimits>, lifecycle: Arc<Lifecycle>)
where
    L: Listener,
    Peer: From<L::Addr>,
{
    let mut open = JoinSet::new();
    let mut stopping = pin!(lifecycle.stopping());
    loop {
        let (io, from) = tokio::select! {
            biased;
            () = &mut stopping => break,
            Some(_) = open.join_next(), if !open.is_empty() => continue,
            accepted = listener.accept() => accepted,
        };
        let from = Peer::from(from);
        let Some(permit) = inbound.sockets.enter(from.address) else {
            tracing::debug!(address = %from.address, "too many connections");
            open.spawn(async { drop(timeout(REFUSAL_TIMEOUT, refuse(io)).await) });
            continue;
        };
        let (caller, router, lifecycle) = (Caller::new(from, permit), router.clone(), lifecycle.clone());
        open.spawn(async move {
            let service = service_fn(move |mut request: Request<Incoming>| {
                request.extensions_mut().insert(ConnectInfo(caller.clone()));
                TowerToHyperService::new(router.clone()).call(request)
            });
            let connection = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(HEAD_TIMEOUT)
                .max_buf_size(HEAD_BYTES)
                .serve_connection(TokioIo::new(io), service)
                .with_upgrades();
            let mut connection = pin!(connection);
            let ended = tokio::select! {
                ended = connection.as_mut() => ended,
                () = lifecycle.stopping() => {
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

/// Sends the refusal and closes the connection.
async fn refuse(mut io: impl AsyncWrite + Unpin) -> io::Result<()> {
    io.write_all(FULL).await?;
    io.shutdown().await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_to_a_refused_connection_is_complete() {
        let text = std::str::from_utf8(FULL).expect("text");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head and a body");
        assert!(head.contains(&format!("content-length: {}", body.len())), "{}", body.len());
        let problem: serde_json::Value = serde_json::from_str(body).expect("JSON");
        assert_eq!(problem["code"], "capacity");
    }
}
