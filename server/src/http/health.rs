//! How the server is: for load balancers, and for Prometheus.

use super::problem::{Problem, store_failed};
use crate::app::App as Host;
use crate::metrics::METRICS;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use palmares_protocol::{Code, Refusal};

/// The process lives.
pub(super) async fn healthz() -> &'static str {
    "ok\n"
}

/// The server can take work: its database answers and it is not shutting down.
pub(super) async fn readyz(State(host): State<Host>) -> Result<&'static str, Problem> {
    if host.lifecycle.is_stopping() {
        return Err(Problem(Refusal::new(Code::Capacity, "the server is shutting down")));
    }
    host.store.ping().await.map_err(|error| store_failed(&error))?;
    Ok("ready\n")
}

/// What the server counts about itself, for Prometheus.
pub(super) async fn metrics(State(host): State<Host>) -> Result<impl IntoResponse, Problem> {
    let unverified = host.store.runs_to_verify().await.map_err(|error| store_failed(&error))?.len();
    let format = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    Ok(([(CONTENT_TYPE, format)], METRICS.text(host.sessions.levels(unverified))))
}
