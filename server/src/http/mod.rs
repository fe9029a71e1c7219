//! HTTP: JSON, files and pages.

mod admin;
mod announcements;
mod coding;
mod competition;
mod csv;
mod equilibrium;
mod extract;
mod hands;
mod health;
mod leaderboard;
mod openapi;
mod pages;
mod places;
pub(crate) mod readiness;
mod replay;
mod runs;
pub(crate) mod state;
mod visuals;

use crate::competition::hands::Submitted;
use crate::http::state::AppState;
use crate::{control, watch};
use axum::Router;
use axum::http::Method;
use axum::http::header::CONTENT_TYPE;
use axum::middleware::from_fn_with_state;
use axum::response::IntoResponse;
use openapi::operation::{CSV, Content, Operation, TEXT, Token, ZIP, get, get_json, of, post, post_json};
use openapi::routes::Routes;
use palmares_models::hand::describe::HandDescription;
use palmares_net::transport;
use palmares_net::transport::problem;
use palmares_store::RunRecord;
use serde_json::Value;
use std::sync::LazyLock;

/// The query `team` of the addresses of hands.
const TEAM_QUERY: &str = "Name of the team, on a practice server";

/// A page.
fn html(path: &'static str, summary: &'static str) -> Operation {
    get(path, summary, Content::Other("text/html"))
}

/// Addresses for all clients and for teams.
fn routes() -> Routes<AppState> {
    Routes::of(Token::None)
        .add(html("/", "The leaderboard as a page"), pages::leaderboard::leaderboard)
        .add(html("/live", "The open runs, as a page"), pages::live)
        .add(html("/live/{session}", "A run as it is played, as a page"), pages::live_session)
        .add(html("/replay", "A replay from a file, as a page"), pages::replay)
        .add(html("/replay/{run}", "A run's replay, as a page"), pages::replay_run)
        .add(html("/drive", "Manual control of a hand, on practice servers, as a page"), pages::drive)
        .add(html("/hands", "The hands, as a page"), pages::hands)
        .add(html("/hands/{name}", "A hand and its equilibria, as a page"), pages::hand)
        .add(html("/teams/{name}", "A team's runs and scores, as a page"), pages::team)
        .add(html("/wall", "The competition on a projector, as a page"), pages::wall)
        .add(html("/admin", "The organizers' page"), pages::admin)
        .add(html("/docs", "The first document, as a page"), pages::documents::first)
        .add(
            html("/docs/search", "Sections of the documents with all words of a search, as a page")
                .query("q", "The words"),
            pages::documents::search,
        )
        .add(
            get(
                "/docs/files/{*path}",
                "A picture, or a file that the documents link to",
                Content::Other("application/octet-stream"),
            ),
            pages::documents::file,
        )
        .add(html("/docs/{*path}", "A document, as a page"), pages::documents::document)
        .add(
            get("/assets/plain.css", "Style sheet of the plain leaderboard", Content::Other("text/css")),
            pages::leaderboard::plain_style,
        )
        .add(
            get(
                "/assets/{file}",
                "A script or style sheet of the pages",
                Content::Other("application/octet-stream"),
            ),
            pages::asset,
        )
        .add(get("/healthz", "The process runs", TEXT), health::healthz)
        .add(get("/readyz", "The server is ready", TEXT), health::readyz)
        .add(
            get("/metrics", "Metrics of the server", Content::Other("application/openmetrics-text")),
            health::metrics,
        )
        .add(get_json::<Value>("/openapi.json", "This document"), openapi)
        .add(
            get("/v1/control", "The control socket of a team", Content::Socket).token(Token::Optional),
            control::control,
        )
        .add(
            get("/v1/watch", "The watch socket of a spectator", Content::Socket).token(Token::Optional),
            watch::watch,
        )
        .add(
            get(
                "/v1/internal/watch/{run}",
                "A run of this host, for the other hosts of a fleet",
                Content::Socket,
            ),
            watch::relay,
        )
        .add(
            get_json::<competition::CompetitionResponse>("/v1/competition", "The competition of this server"),
            competition::competition,
        )
        .add(get_json::<competition::Tasks>("/v1/tasks", "The tasks"), competition::tasks)
        .add(
            get_json::<hands::Hands>("/v1/hands", "Short descriptions of the hands")
                .query("team", TEAM_QUERY)
                .token(Token::Optional),
            hands::list,
        )
        .add(
            post("/v1/hands", "Upload a hand", ZIP, of::<Submitted>())
                .query("team", TEAM_QUERY)
                .token(Token::Optional)
                .created(),
            hands::submit,
        )
        .add(
            get_json::<HandDescription>("/v1/hands/{name}", "The full description of a hand")
                .query("team", TEAM_QUERY)
                .token(Token::Optional),
            hands::describe,
        )
        .add(
            post_json::<equilibrium::EquilibriumRequest, equilibrium::EquilibriumResponse>(
                "/v1/hands/{name}/equilibrium",
                "The equilibrium of a hand under forces and with held points, without a world",
            )
            .query("team", TEAM_QUERY)
            .token(Token::Optional),
            equilibrium::equilibrium,
        )
        .add(
            get_json::<visuals::Visuals>(
                "/v1/hands/{name}/visuals",
                "Visual shapes of a hand's links, where they differ from the collision shapes",
            )
            .query("team", TEAM_QUERY)
            .token(Token::Optional),
            visuals::visuals,
        )
        .add(get_json::<leaderboard::Leaderboard>("/v1/leaderboard", "The ranking"), leaderboard::json)
        .add(get("/v1/leaderboard.csv", "The ranking as a table", CSV), leaderboard::csv)
        .add(
            get_json::<announcements::Announcements>(
                "/v1/announcements",
                "Announcements of the organizers, newest first",
            ),
            announcements::list,
        )
        .add(
            get_json::<runs::Sessions>(
                "/v1/sessions",
                "The sessions: a team's own; all for organizers and viewers",
            )
            .token(Token::Optional),
            runs::sessions,
        )
        .add(
            get_json::<runs::RunList>("/v1/runs", "The newest runs with a replay that the client may see")
                .query("team", "Runs of this team")
                .query("task", "Runs of this task")
                .query("limit", "Number of runs among which to look, at most and by default 200")
                .token(Token::Optional),
            runs::runs,
        )
        .add(get_json::<RunRecord>("/v1/runs/{id}", "A run as stored").token(Token::Optional), runs::run)
        .add(
            get(
                "/v1/runs/{id}/replay",
                "A run's replay, an MCAP file",
                Content::Other("application/octet-stream"),
            )
            .token(Token::Optional),
            replay::replay,
        )
}

/// All addresses of the server.
pub(crate) fn router(app: AppState) -> Router {
    let admin = admin::routes().router;
    let admin = admin.route_layer(from_fn_with_state(app.clone(), admin::to_owner));
    let admin = admin.route_layer(from_fn_with_state(app.clone(), admin::only_organizers));
    let router = routes().router.merge(admin);
    router
        .fallback(pages::nothing_here)
        .method_not_allowed_fallback(async |method: Method| problem::method_not_allowed(&method))
        .layer(from_fn_with_state(app.clone(), transport::guard))
        .with_state(app)
}

/// The addresses as an OpenAPI document.
pub(crate) fn document() -> Value {
    openapi::document(&operations())
}

fn operations() -> Vec<Operation> {
    let mut all = routes().operations;
    all.extend(admin::routes().operations);
    all
}

/// `GET /openapi.json`.
async fn openapi() -> impl IntoResponse {
    static TEXT: LazyLock<String> = LazyLock::new(|| document().to_string());
    ([(CONTENT_TYPE, "application/json")], TEXT.as_str())
}
