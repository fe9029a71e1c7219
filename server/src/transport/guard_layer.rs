//! Checks every request before its handler runs.

use super::inbound_limits::InboundLimits;
use crate::problem::Problem;
use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Passes on the requests that the guard accepts.
pub(crate) async fn guard(
    State(inbound): State<Arc<InboundLimits>>,
    request: Request,
    next: Next,
) -> Response {
    match inbound.guard.check(request.method(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => Problem(refusal).into_response(),
    }
}
