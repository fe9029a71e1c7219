//! Everything that is not a stream: JSON over HTTP, and the leaderboard as a page.

pub(crate) mod openapi;
mod page;
mod problem;
mod replay;
mod rest;

pub(crate) use problem::Problem;

use crate::session::Host;
use crate::{watch, ws};
use axum::Router;
use axum::http::Method;
use axum::routing::get;
use std::sync::Arc;

/// All addresses of the server.
pub(crate) fn router(host: Arc<Host>) -> Router {
    Router::new()
        .route("/", get(page::leaderboard))
        .route("/healthz", get(rest::healthz))
        .route("/readyz", get(rest::readyz))
        .route("/metrics", get(rest::metrics))
        .route("/openapi.json", get(openapi::openapi))
        .route("/v1/control", get(ws::control))
        .route("/v1/watch", get(watch::watch))
        .route("/v1/competition", get(rest::competition))
        .route("/v1/tasks", get(rest::tasks))
        .route("/v1/hands", get(rest::hands))
        .route("/v1/hands/{name}", get(rest::hand))
        .route("/v1/leaderboard", get(rest::leaderboard))
        .route("/v1/runs/{id}", get(rest::run))
        .route("/v1/runs/{id}/replay", get(replay::replay))
        .fallback(rest::nothing_here)
        .method_not_allowed_fallback(async |method: Method| problem::method_not_allowed(&method))
        .with_state(host)
}
