//! Checks every request before its handler runs, and finds the address of its client.

use super::caller::Caller;
use super::inbound_limits::InboundLimits;
use crate::transport::problem::Problem;
use axum::extract::{ConnectInfo, Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Passes on the requests that the guard accepts.
pub async fn guard(State(inbound): State<Arc<InboundLimits>>, mut request: Request, next: Next) -> Response {
    if let Some(ConnectInfo(caller)) = request.extensions().get::<ConnectInfo<Caller>>() {
        let caller = caller.clone().behind(&inbound.sockets.proxies, request.headers());
        request.extensions_mut().insert(ConnectInfo(caller));
    }
    match inbound.guard.check(request.method(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => Problem(refusal).into_response(),
    }
}
