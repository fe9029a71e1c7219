//! The pages: their HTML frames, and the leaderboard as plain HTML. The scripts are in `viewer/`.

mod assets;
pub(super) mod documents;
pub(super) mod leaderboard;
mod rules_in_words;
mod shell;

pub(super) use assets::asset;

use crate::competition::Competition;
use axum::extract::{Path, State};
use axum::response::IntoResponse;
use shell::{Page, respond, without_script};
use std::sync::Arc;

/// The frame of a page that its script fills.
fn page(name: &str, title: &str, argument: &str, competition: &Competition) -> impl IntoResponse + use<> {
    let body = without_script(name);
    respond(
        &Page {
            name,
            argument,
            title,
            body,
            plain_style: Some(leaderboard::PLAIN),
            refresh_s: None,
            form: false,
        },
        competition,
    )
}

/// `GET /live`.
pub(super) async fn live(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("live", "Live", "", &competition)
}

/// `GET /live/{session}`.
pub(super) async fn live_session(
    State(competition): State<Arc<Competition>>,
    Path(session): Path<String>,
) -> impl IntoResponse {
    page("live", "Live", &session, &competition)
}

/// `GET /replay`.
pub(super) async fn replay(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("replay", "Replay", "", &competition)
}

/// `GET /replay/{run}`.
pub(super) async fn replay_run(
    State(competition): State<Arc<Competition>>,
    Path(run): Path<String>,
) -> impl IntoResponse {
    page("replay", "Replay", &run, &competition)
}

/// `GET /drive`.
pub(super) async fn drive(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("drive", "Drive", "", &competition)
}

/// `GET /hands`.
pub(super) async fn hands(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("hands", "Hands", "", &competition)
}

/// `GET /hands/{name}`.
pub(super) async fn hand(
    State(competition): State<Arc<Competition>>,
    Path(name): Path<String>,
) -> impl IntoResponse {
    page("hands", "Hands", &name, &competition)
}

/// `GET /wall`.
pub(super) async fn wall(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("wall", "Wall", "", &competition)
}

/// `GET /admin`.
pub(super) async fn admin(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("admin", "Organizers", "", &competition)
}
