//! Addresses for organizers: teams and tokens, the competition's phases, sessions, runs, hands, exports.
//!
//! An action is `POST /v1/admin/<noun>/<verb>` with a JSON body that has the id of its object; reading is a GET. Every action writes an
//! audit entry with its reason.

mod announcement;
mod competition;
mod export;
mod forward;
mod hands;
mod request;
mod runs;
mod schedule;
mod sessions;
mod teams;

pub(super) use forward::to_owner;

use super::openapi::operation::{Operation, Token, ZIP, get, get_json, post_json};
use super::openapi::routes::Routes;
use super::runs::RunList;
use crate::http::state::AppState;
use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use palmares_net::auth::Auth;
use palmares_net::transport::problem::Problem;
use palmares_store::{Announcement, Store};
use serde_json::{Map, Value};
use std::sync::Arc;
use teams::{
    IssuedToken, NewToken, RevokedTokens, TeamActionRequest, TeamCheckRequest, TeamCheckResponse, Teams,
    TokenActionRequest, Tokens,
};

/// The organizers' addresses.
pub(super) fn routes() -> Routes<AppState> {
    Routes::of(Token::Organizer)
        .add(
            post_json::<competition::CompetitionActionRequest, competition::CompetitionActionResponse>(
                "/v1/admin/competition/{verb}",
                "Open the competition for sessions or close it for new ones; pause, resume or end all sessions; publish the secret of the seeds",
            )
            .words(&["open", "close", "reveal", "pause", "resume", "end"]),
            competition::act,
        )
        .add(get_json::<schedule::Schedule>("/v1/admin/schedule", "The time slots of teams"), schedule::show)
        .add(
            post_json::<schedule::ScheduleActionRequest, schedule::Schedule>(
                "/v1/admin/schedule/{verb}",
                "Import a schedule from CSV; add, move or remove slots",
            )
            .words(&["import", "add", "move", "clear"]),
            schedule::act,
        )
        .add(
            post_json::<announcement::NewAnnouncement, Announcement>(
                "/v1/admin/announcement",
                "Send an announcement to the pages and the watch socket",
            ),
            announcement::announce,
        )
        .add(post_json::<TeamActionRequest, IssuedToken>("/v1/admin/team/add", "Add a team; returns its token"), teams::add)
        .add(
            post_json::<TeamCheckRequest, TeamCheckResponse>(
                "/v1/admin/team/check",
                "Whether teams can be added; changes nothing",
            ),
            teams::check,
        )
        .add(
            post_json::<TeamActionRequest, IssuedToken>(
                "/v1/admin/team/rotate",
                "Replace a team's token",
            ),
            teams::rotate,
        )
        .add(
            post_json::<TeamActionRequest, RevokedTokens>("/v1/admin/team/revoke", "Revoke a team's tokens"),
            teams::revoke,
        )
        .add(get_json::<Teams>("/v1/admin/teams", "The teams"), teams::list)
        .add(
            post_json::<NewToken, IssuedToken>(
                "/v1/admin/token/add",
                "Create a token for an organizer or a viewer",
            ),
            teams::add_token,
        )
        .add(
            post_json::<TokenActionRequest, RevokedTokens>("/v1/admin/token/revoke", "Revoke a token"),
            teams::revoke_token,
        )
        .add(get_json::<Tokens>("/v1/admin/tokens", "The tokens without their secrets"), teams::tokens)
        .add(
            post_json::<sessions::SessionActionRequest, sessions::SessionActionResponse>(
                "/v1/admin/session/{verb}",
                "Pause, resume, end or void a session, or grant it time and take granted time back",
            )
            .words(&["pause", "resume", "end", "void", "grant"]),
            sessions::act,
        )
        .add(
            post_json::<runs::RunActionRequest, runs::RunActionResponse>(
                "/v1/admin/run/{verb}",
                "Void a run and refund its time, undo that, or verify its replay again",
            )
            .words(&["void", "unvoid", "reverify"]),
            runs::act,
        )
        .add(
            listed(get_json::<RunList>("/v1/admin/runs", "Runs without their events, newest first"))
                .query("task", "Only runs of this task"),
            runs::list,
        )
        .add(
            get_json::<runs::SimilarRuns>(
                "/v1/admin/similar",
                "Pairs of runs of two teams with the same movements, the greatest common share first",
            )
            .query("team", "Only pairs with a run of this team")
            .query("task", "Only runs of this task")
            .query("limit", "Max pairs; 1000 if left out, and at most"),
            runs::similar,
        )
        .add(listed(get_json::<hands::List>("/v1/admin/hands", "The hands of all teams, oldest first")), hands::list)
        .add(
            get_json::<hands::Shown>(
                "/v1/admin/hands/{id}",
                "A hand's figures, with those of the built-in hands and the limits",
            ),
            hands::show,
        )
        .add(get("/v1/admin/hands/{id}/archive", "A hand's archive, as uploaded", ZIP), hands::archive)
        .add(
            post_json::<hands::HandActionRequest, hands::HandActionResponse>(
                "/v1/admin/hand/{verb}",
                "Approve or reject a team's hand for official sessions",
            )
            .words(&["approve", "reject"]),
            hands::decide,
        )
        .add(
            get_json::<export::Records>("/v1/admin/audit", "The audit: actions with time and reason")
                .query("after", "Only records after this number")
                .query("limit", "Max records; 1000 if left out, and at most"),
            export::audit,
        )
        .add(
            get_json::<Vec<Map<String, Value>>>("/v1/admin/export/{what}", "A whole table, as a list of rows")
                .words(&["leaderboard", "sessions", "runs", "audit"])
                .query("format", "json or csv"),
            export::export,
        )
        .add(get("/v1/admin/backup", "A backup of everything, secrets included", ZIP), export::backup)
}

/// The query of a list.
fn listed(operation: Operation) -> Operation {
    operation
        .query("team", "Only those of this team")
        .query("status", "Only those of this status")
        .query("since_unix_ms", "Only those that began, or were uploaded, at this time or later")
        .query("until_unix_ms", "Only those that began, or were uploaded, at this time or earlier")
        .query("after", "The id of the last row of the page before")
        .query("limit", "Max rows; 1000 if left out, and at most")
}

/// Accepts organizers only, and adds their identity to the request. Runs before the body is read.
pub(super) async fn only_organizers(
    State(auth): State<Arc<Auth>>,
    State(store): State<Store>,
    mut request: Request,
    next: Next,
) -> Response {
    match auth.organizer(&store, request.headers()).await {
        Ok(identity) => {
            request.extensions_mut().insert(identity);
            next.run(request).await
        }
        Err(refusal) => Problem(refusal).into_response(),
    }
}
