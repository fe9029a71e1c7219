//! Health checks, and metrics for Prometheus.

use crate::fleet::lease::Lease;
use crate::http::readiness::Readiness;
use crate::session::Sessions;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use palmares_metrics::METRICS;
use palmares_net::process::lifecycle::Lifecycle;
use palmares_net::transport::problem::{Problem, not_ready};
use palmares_protocol::Code;
use palmares_store::Store;
use palmares_store::files::disk_space;
use std::sync::Arc;

/// The process runs.
pub(super) async fn healthz() -> &'static str {
    "ok\n"
}

/// The server is ready: it can write in its database and its data directory, and it is not shutting down. Otherwise 503 with the reason.
pub(super) async fn readyz(
    State(lifecycle): State<Arc<Lifecycle>>,
    State(lease): State<Arc<Lease>>,
    State(readiness): State<Arc<Readiness>>,
) -> Result<&'static str, Response> {
    if !lease.is_valid() {
        return Err(not_ready(Code::Internal, "the database does not answer"));
    }
    if lifecycle.is_stopping() {
        return Err(not_ready(Code::Capacity, "the server is shutting down"));
    }
    readiness.prove().await.map_err(|why| not_ready(Code::Internal, &why))?;
    Ok("ready\n")
}

/// The metrics.
pub(super) async fn metrics(
    State(sessions): State<Arc<Sessions>>,
    State(store): State<Store>,
    State(readiness): State<Arc<Readiness>>,
) -> Result<impl IntoResponse, Problem> {
    match disk_space::space(readiness.data_dir()) {
        Ok(space) => {
            METRICS.data_free.set(space.free_bytes);
            METRICS.data_size.set(space.size_bytes);
        }
        Err(error) => tracing::warn!(%error, "the space of the data directory is not known"),
    }
    let queue = store.verification_queue().await?;
    METRICS.verification_oldest.set(queue.oldest().as_secs_f64());
    METRICS.verification_stuck.set(u64::try_from(queue.stuck).unwrap_or_default());
    METRICS.unverified.set(u64::try_from(queue.waiting).unwrap_or_default());
    let admission = &sessions.compute.admission;
    let worlds = admission.open();
    METRICS.worlds.set(worlds.with_idle() as u64);
    METRICS.idle_worlds.set(worlds.idle as u64);
    METRICS.waiting.set(admission.waiting().len() as u64);
    METRICS.sessions.set(sessions.registry.len() as u64);
    METRICS.viewers.set(sessions.hub.viewers() as u64);
    let format = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    Ok(([(CONTENT_TYPE, format)], METRICS.text()))
}
