//! Everything that is not a stream: JSON over HTTP, and the leaderboard as a page.

mod admin;
mod csv;
mod hands;
pub(crate) mod openapi;
mod page;
mod parts;
mod problem;
mod replay;
mod rest;
mod runs;

pub(crate) use problem::Problem;

use crate::app::App as Host;
use crate::{transport, watch};
use axum::Router;
use axum::http::Method;
use axum::middleware;
use axum::routing::get;

/// All addresses of the server.
pub(crate) fn router(host: Host) -> Router {
    Router::new()
        .route("/", get(page::leaderboard))
        .route("/healthz", get(rest::healthz))
        .route("/readyz", get(rest::readyz))
        .route("/metrics", get(rest::metrics))
        .route("/openapi.json", get(openapi::openapi))
        .route("/v1/control", get(transport::control))
        .route("/v1/watch", get(watch::watch))
        .route("/v1/competition", get(rest::competition))
        .route("/v1/tasks", get(rest::tasks))
        .route("/v1/hands", get(hands::list).post(hands::submit))
        .route("/v1/hands/{name}", get(hands::describe))
        .route("/v1/leaderboard", get(rest::leaderboard))
        .route("/v1/leaderboard.csv", get(rest::leaderboard_csv))
        .route("/v1/sessions", get(runs::sessions))
        .route("/v1/runs/{id}", get(runs::run))
        .route("/v1/runs/{id}/replay", get(replay::replay))
        .merge(admin::router(&host))
        .fallback(rest::nothing_here)
        .method_not_allowed_fallback(async |method: Method| problem::method_not_allowed(&method))
        .layer(middleware::from_fn_with_state(host.clone(), transport::guard))
        .with_state(host)
}
