//! Health checks, and metrics for Prometheus.

use crate::fleet::lease::Lease;
use crate::lifecycle::Lifecycle;
use crate::metrics::METRICS;
use crate::problem::Problem;
use crate::session::Sessions;
use crate::store::Store;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use palmares_protocol::Code;
use std::sync::Arc;

/// The process runs.
pub(super) async fn healthz() -> &'static str {
    "ok\n"
}

/// The server is ready: its database answers and it is not shutting down.
pub(super) async fn readyz(
    State(lifecycle): State<Arc<Lifecycle>>,
    State(lease): State<Arc<Lease>>,
    State(store): State<Store>,
) -> Result<&'static str, Problem> {
    if !lease.is_valid() {
        return Err(Problem::new(Code::Internal, "the database does not answer"));
    }
    if lifecycle.is_stopping() {
        return Err(Problem::new(Code::Capacity, "the server is shutting down"));
    }
    store.ping().await?;
    Ok("ready\n")
}

/// The metrics.
pub(super) async fn metrics(
    State(sessions): State<Arc<Sessions>>,
    State(store): State<Store>,
) -> Result<impl IntoResponse, Problem> {
    let queue = store.verification_queue().await?;
    METRICS.verification(queue.oldest(), usize::try_from(queue.stuck).unwrap_or_default());
    let unverified = usize::try_from(queue.waiting).unwrap_or_default();
    let format = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    Ok(([(CONTENT_TYPE, format)], METRICS.text(sessions.gauges(unverified))))
}
