//! The pages: their HTML frames, and the leaderboard as plain HTML. The scripts are in `viewer/`.

mod assets;
pub(super) mod documents;
pub(super) mod leaderboard;
mod rules_in_words;
mod shell;

pub(super) use assets::asset;

use crate::competition::Competition;
use axum::extract::{Path, State};
use axum::http::header::ACCEPT;
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use maud::html;
use palmares_net::transport::problem;
use palmares_protocol::text::shortened;
use shell::{Page, respond, without_script};
use std::sync::Arc;

/// Addresses of programs: these get JSON even where a browser asks.
const OF_PROGRAMS: [&str; 2] = ["/v1/", "/assets/"];

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

/// `GET /teams/{name}`.
pub(super) async fn team(
    State(competition): State<Arc<Competition>>,
    Path(name): Path<String>,
) -> impl IntoResponse {
    page("team", "Team", &name, &competition)
}

/// `GET /wall`.
pub(super) async fn wall(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("wall", "Wall", "", &competition)
}

/// `GET /admin`.
pub(super) async fn admin(State(competition): State<Arc<Competition>>) -> impl IntoResponse {
    page("admin", "Organizers", "", &competition)
}

/// An unknown address: a page for browsers, a problem for programs.
pub(super) async fn nothing_here(
    State(competition): State<Arc<Competition>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    let accepted = headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let browser = accepted.flat_map(|value| value.split([',', ';'])).any(|kind| kind.trim() == "text/html");
    if !browser || OF_PROGRAMS.iter().any(|start| uri.path().starts_with(start)) {
        return problem::nothing_here(uri).await.into_response();
    }
    let body = html! {
        div.title { h1 { "No page here" } }
        p { "This server has nothing at " code { (shortened(uri.path())) } "." }
        ul {
            li { a href="/" { "Leaderboard" } ": the teams and their best runs" }
            li { a href="/live" { "Live" } ": the runs that are being played" }
            li { a href="/replay" { "Replay" } ": finished runs, or a file" }
            li { a href="/hands" { "Hands" } ": the hands, with their figures" }
            @if !competition.rules.official() {
                li { a href="/drive" { "Drive" } ": a hand, moved by yourself" }
            }
            li { a href="/wall" { "Wall" } ": the event on a projector" }
            li { a href="/docs" { "Documents" } ": the guides, with a search" }
        }
    };
    let plain_style = Some(leaderboard::PLAIN);
    let (name, title) = ("missing", "No page here");
    let page = Page { name, argument: "", title, body, plain_style, refresh_s: None, form: false };
    (StatusCode::NOT_FOUND, respond(&page, &competition)).into_response()
}
