//! The addresses, one entry each.

use super::super::rest;
use super::{Content, Operation, get, of};
use crate::store::RunRecord;
use palmares_models::describe::HandDescription;
use serde_json::Value;

const TEXT: Content = Content::Other("text/plain");

/// Every address and method of the router.
pub(super) fn operations() -> Vec<Operation> {
    vec![
        get("/", "The leaderboard as a page", Content::Other("text/html")),
        get("/healthz", "The process lives", TEXT),
        get("/readyz", "The server can take work", TEXT),
        get(
            "/metrics",
            "What the server counts about itself",
            Content::Other("application/openmetrics-text"),
        ),
        get("/openapi.json", "This document", of::<Value>()),
        get("/v1/control", "The control socket of a team", Content::Socket),
        get("/v1/watch", "The watch socket of a spectator", Content::Socket),
        get("/v1/competition", "What is being played here", of::<rest::CompetitionAnswer>()),
        get("/v1/tasks", "The tasks", of::<rest::Tasks>()),
        get("/v1/hands", "The hands in short", of::<rest::Hands>()),
        get("/v1/hands/{name}", "A hand in full", of::<HandDescription>()),
        get("/v1/leaderboard", "The ranking", of::<rest::Leaderboard>()),
        get("/v1/runs/{id}", "A run as stored", of::<RunRecord>()),
        get(
            "/v1/runs/{id}/replay",
            "A run's replay, an MCAP file",
            Content::Other("application/octet-stream"),
        ),
    ]
}
