//! The leaderboard for programs.

use super::csv;
use crate::competition::Competition;
use crate::watch::RankingCache;
use axum::Json;
use axum::extract::State;
use axum::http::header::CACHE_CONTROL;
use axum::response::{IntoResponse, Response};
use palmares_net::transport::problem::Problem;
use palmares_store::{LeaderboardRow, unix_ms};
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// The ranking.
#[derive(Serialize, JsonSchema)]
pub(super) struct Leaderboard<'a> {
    tasks: Vec<String>,
    rows: &'a [LeaderboardRow],
    unix_ms: i64,
}

/// The ranking.
pub(super) async fn json(
    State(competition): State<Arc<Competition>>,
    State(ranking): State<Arc<RankingCache>>,
) -> Result<Response, Problem> {
    let ranking = ranking.current().await?;
    let tasks = competition.task_names();
    let body = Leaderboard { tasks, rows: &ranking.rows, unix_ms: unix_ms() };
    Ok(([(CACHE_CONTROL, "no-store")], Json(body)).into_response())
}

/// The ranking as a table.
pub(super) async fn csv(
    State(competition): State<Arc<Competition>>,
    State(ranking): State<Arc<RankingCache>>,
) -> Result<Response, Problem> {
    let ranking = ranking.current().await?;
    Ok(csv::response(&csv::leaderboard(&ranking.rows, &competition.task_names())))
}
