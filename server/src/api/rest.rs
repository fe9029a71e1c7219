//! The JSON addresses.

use super::Problem;
use crate::metrics::METRICS;
use crate::protocol::reply::{Competition, HandInfo, Limits, ServerInfo, TaskInfo};
use crate::protocol::request::shortened;
use crate::protocol::{Code, Refusal};
use crate::session::Host;
use crate::store::{LeaderboardRow, RunRecord, StoreError, unix_ms};
use axum::Json;
use axum::extract::{Path, State};
use axum::http::Uri;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::IntoResponse;
use palmares_models::describe::HandDescription;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

type Answer<T> = Result<Json<T>, Problem>;

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
    if host.is_stopping() {
        return Err(Problem(Refusal::new(Code::Capacity, "the server is shutting down")));
    }
    host.store.ping().await.map_err(|error| store_failed(&error))?;
    Ok("ready\n")
}

/// What the server counts about itself, for Prometheus.
pub(super) async fn metrics(State(host): State<Arc<Host>>) -> Result<impl IntoResponse, Problem> {
    let unverified = host.store.runs_to_verify().await.map_err(|error| store_failed(&error))?.len();
    let format = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    Ok(([(CONTENT_TYPE, format)], METRICS.text(host.levels(unverified))))
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
}

/// What is being played here.
pub(super) async fn competition(State(host): State<Arc<Host>>) -> Json<CompetitionAnswer> {
    Json(CompetitionAnswer {
        competition: host.competition(),
        server: ServerInfo::own(),
        limits: host.limits(),
        tasks: host.tasks.iter().map(|task| task.name.clone()).collect(),
        hands: host.hands.iter().map(|hand| hand.name.clone()).collect(),
        replay_key: host.replays.as_ref().map(|archive| archive.key().to_string()),
    })
}

/// The tasks.
#[derive(Serialize, JsonSchema)]
pub(super) struct Tasks {
    tasks: Vec<TaskInfo>,
}

/// The tasks.
pub(super) async fn tasks(State(host): State<Arc<Host>>) -> Json<Tasks> {
    Json(Tasks { tasks: host.task_infos() })
}

/// The hands in short.
#[derive(Serialize, JsonSchema)]
pub(super) struct Hands {
    hands: Vec<HandInfo>,
}

/// The hands in short.
pub(super) async fn hands(State(host): State<Arc<Host>>) -> Json<Hands> {
    Json(Hands { hands: host.hand_infos() })
}

/// A hand in full.
pub(super) async fn hand(State(host): State<Arc<Host>>, Path(name): Path<String>) -> Answer<HandDescription> {
    match host.hand(&name) {
        Some(hand) => Ok(Json(hand.describe())),
        None => {
            let message = format!("no hand `{}`; GET /v1/hands lists them", shortened(&name));
            Err(Problem(Refusal::new(Code::UnknownHand, message)))
        }
    }
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
    let rows = host.store.leaderboard(false).await.map_err(|error| store_failed(&error))?;
    let tasks = host.tasks.iter().map(|task| task.name.clone()).collect();
    Ok(([(CACHE_CONTROL, "no-store")], Json(Leaderboard { tasks, rows, unix_ms: unix_ms() })))
}

/// A run.
pub(super) async fn run(State(host): State<Arc<Host>>, Path(id): Path<String>) -> Answer<RunRecord> {
    match host.store.run(&id).await.map_err(|error| store_failed(&error))? {
        Some(run) => Ok(Json(run)),
        None => Err(Problem(Refusal::new(Code::NotFound, format!("no run `{}`", shortened(&id))))),
    }
}

/// Anything else.
pub(super) async fn nothing_here(uri: Uri) -> Problem {
    let message = format!("nothing at {}", shortened(uri.path()));
    Problem(Refusal::new(Code::NotFound, message))
}
