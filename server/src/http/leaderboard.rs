//! The leaderboard for programs.

use super::csv;
use crate::competition::Competition;
use crate::problem::Problem;
use crate::store::Store;
use crate::store::{LeaderboardRow, unix_ms};
use axum::Json;
use axum::extract::State;
use axum::http::header::CACHE_CONTROL;
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// The ranking.
#[derive(Serialize, JsonSchema)]
pub(super) struct Leaderboard {
    tasks: Vec<String>,
    rows: Vec<LeaderboardRow>,
    unix_ms: i64,
}

/// The ranking.
pub(super) async fn json(
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
) -> Result<impl IntoResponse, Problem> {
    let rows = store.leaderboard(competition.rules.official()).await?;
    let tasks = competition.task_names();
    Ok(([(CACHE_CONTROL, "no-store")], Json(Leaderboard { tasks, rows, unix_ms: unix_ms() })))
}

/// The ranking as a table.
pub(super) async fn csv(
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
) -> Result<Response, Problem> {
    let rows = store.leaderboard(competition.rules.official()).await?;
    Ok(csv::response(&csv::leaderboard(&rows, &competition.task_names())))
}
