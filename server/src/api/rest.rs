//! The JSON addresses.

use super::{Problem, csv};
use crate::app::App as Host;
use crate::metrics::METRICS;
use crate::protocol::reply::{Competition, Limits, ServerInfo, TaskInfo};
use crate::protocol::request::shortened;
use crate::protocol::{Code, Refusal};
use crate::rules::Phase;
use crate::store::{LeaderboardRow, StoreError, unix_ms};
use crate::version;
use axum::Json;
use axum::extract::State;
use axum::http::Uri;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// Logs a failure of the store and words it for the client.
pub(super) fn store_failed(error: &StoreError) -> Problem {
    tracing::error!(%error, "store failed");
    Problem(Refusal::new(Code::Internal, "the database does not answer").retry_after(5.0))
}

/// The process lives.
pub(super) async fn healthz() -> &'static str {
    "ok\n"
}

/// The server can take work: its database answers and it is not shutting down.
pub(super) async fn readyz(State(host): State<Arc<Host>>) -> Result<&'static str, Problem> {
    if host.lifecycle.is_stopping() {
        return Err(Problem(Refusal::new(Code::Capacity, "the server is shutting down")));
    }
    host.store.ping().await.map_err(|error| store_failed(&error))?;
    Ok("ready\n")
}

/// What the server counts about itself, for Prometheus.
pub(super) async fn metrics(State(host): State<Arc<Host>>) -> Result<impl IntoResponse, Problem> {
    let unverified = host.store.runs_to_verify().await.map_err(|error| store_failed(&error))?.len();
    let format = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    Ok(([(CONTENT_TYPE, format)], METRICS.text(host.sessions.levels(unverified))))
}

/// What is being played here.
#[derive(Serialize, JsonSchema)]
pub(super) struct CompetitionAnswer {
    #[serde(flatten)]
    competition: Competition,
    server: ServerInfo,
    limits: Limits,
    tasks: Vec<String>,
    hands: Vec<String>,
    /// Public key that replays are signed with.
    #[serde(skip_serializing_if = "Option::is_none")]
    replay_key: Option<String>,
    /// How far it is; official competitions only.
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<Phase>,
    /// Sessions that a team has.
    #[serde(skip_serializing_if = "Option::is_none")]
    sessions_per_team: Option<u32>,
    /// SHA-256 of the secret that the seeds are made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret_sha256: Option<String>,
    /// The secret itself, once it is revealed.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret: Option<String>,
}

/// What is being played here.
pub(super) async fn competition(State(host): State<Arc<Host>>) -> Json<CompetitionAnswer> {
    let rules = &host.competition.rules;
    Json(CompetitionAnswer {
        competition: host.competition.info(),
        server: version::own(),
        limits: host.competition.limits(),
        tasks: host.competition.task_names(),
        hands: host.competition.hands.iter().map(|hand| hand.name.clone()).collect(),
        replay_key: host.archive.as_ref().map(|archive| archive.key().to_string()),
        phase: rules.official().then(|| rules.phase()),
        sessions_per_team: rules.official().then_some(rules.sessions_per_team),
        seed_secret_sha256: rules.secret_sha256(),
        seed_secret: rules.revealed_secret(),
    })
}

/// The tasks.
#[derive(Serialize, JsonSchema)]
pub(super) struct Tasks {
    tasks: Vec<TaskInfo>,
}

/// The tasks.
pub(super) async fn tasks(State(host): State<Arc<Host>>) -> Json<Tasks> {
    Json(Tasks { tasks: host.competition.task_infos() })
}

/// The ranking.
#[derive(Serialize, JsonSchema)]
pub(super) struct Leaderboard {
    tasks: Vec<String>,
    rows: Vec<LeaderboardRow>,
    unix_ms: i64,
}

/// The ranking.
pub(super) async fn leaderboard(State(host): State<Arc<Host>>) -> Result<impl IntoResponse, Problem> {
    let rows = host
        .store
        .leaderboard(host.competition.rules.official())
        .await
        .map_err(|error| store_failed(&error))?;
    let tasks = host.competition.task_names();
    Ok(([(CACHE_CONTROL, "no-store")], Json(Leaderboard { tasks, rows, unix_ms: unix_ms() })))
}

/// The ranking as a table.
pub(super) async fn leaderboard_csv(State(host): State<Arc<Host>>) -> Result<Response, Problem> {
    let rows = host
        .store
        .leaderboard(host.competition.rules.official())
        .await
        .map_err(|error| store_failed(&error))?;
    Ok(csv::response(&csv::leaderboard(&rows, &host.competition.task_names())))
}

/// Anything else.
pub(super) async fn nothing_here(uri: Uri) -> Problem {
    let message = format!("nothing at {}", shortened(uri.path()));
    Problem(Refusal::new(Code::NotFound, message))
}
