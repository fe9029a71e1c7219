//! What organizers do: teams and tokens, the competition's phases, sessions, runs, hands, exports.
//!
//! Every address is `POST /v1/admin/<noun>/<verb>` with a JSON body, or a GET for what only looks. The ids
//! of what is acted on stand in bodies, not in paths. Every action leaves an audit entry with its reason.

mod competition;
mod export;
mod hands;
mod request;
mod runs;
mod sessions;
mod teams;

use super::openapi::operation::{Token, ZIP, get, of, post};
use super::openapi::routes::Routes;
use super::problem::Problem;
use crate::session::Host;
use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};
use std::sync::Arc;

/// The organizers' addresses.
pub(super) fn routes() -> Routes<Arc<Host>> {
    Routes::of(Token::Organizer)
        .add(post("/v1/admin/competition/{verb}", "Let sessions begin, let no further one begin, end it for good and publish the secret of the seeds", of::<competition::Body>(), of::<competition::Answer>()).words(&["open", "close", "reveal"]), competition::enter)
        .add(post("/v1/admin/team/add", "Add a team; answers its token", of::<teams::TeamBody>(), of::<teams::Issued>()), teams::add)
        .add(post("/v1/admin/team/rotate", "Give a team a new token instead of the old", of::<teams::TeamBody>(), of::<teams::Issued>()), teams::rotate)
        .add(post("/v1/admin/team/revoke", "Take a team's tokens back", of::<teams::TeamBody>(), of::<teams::Revoked>()), teams::revoke)
        .add(get("/v1/admin/teams", "The teams", of::<teams::Teams>()), teams::list)
        .add(post("/v1/admin/token/add", "Make a token for an organizer or a viewer", of::<teams::TokenBody>(), of::<teams::Issued>()), teams::add_token)
        .add(post("/v1/admin/token/revoke", "Take a token back", of::<teams::TokenId>(), of::<teams::Revoked>()), teams::revoke_token)
        .add(get("/v1/admin/tokens", "The tokens without their secrets", of::<teams::Tokens>()), teams::tokens)
        .add(post("/v1/admin/session/{verb}", "Hold a session, let it go on, end it, void it, give it time", of::<sessions::Body>(), of::<sessions::Answer>()).words(&["pause", "resume", "end", "void", "grant"]), sessions::act)
        .add(post("/v1/admin/run/{verb}", "Void a run and give its time back, or have its replay played again", of::<runs::Body>(), of::<runs::Answer>()).words(&["void", "reverify"]), runs::act)
        .add(get("/v1/admin/hands", "The hands of all teams", of::<hands::List>()), hands::list)
        .add(get("/v1/admin/hands/{id}", "A hand's figures beside those of the program's hands and the limits", of::<hands::Shown>()), hands::show)
        .add(get("/v1/admin/hands/{id}/archive", "A hand's archive, as it was sent in", ZIP), hands::archive)
        .add(post("/v1/admin/hand/{verb}", "Let a team play a hand of its own officially, or do not", of::<hands::Body>(), of::<hands::Decided>()).words(&["approve", "reject"]), hands::decide)
        .add(get("/v1/admin/audit", "Who decided what, when and why", of::<export::Records>()).query("after", "Only records after this number").query("limit", "At most so many, 1000 if left out, and never more"), export::audit)
        .add(get("/v1/admin/export/{what}", "A table, whole: a list of rows", of::<Vec<Map<String, Value>>>()).words(&["leaderboard", "sessions", "runs", "audit"]).query("format", "json or csv"), export::export)
        .add(get("/v1/admin/backup", "Everything as one archive, secrets included", ZIP), export::backup)
}

/// Lets organizers through, and tells the addresses who they are. Runs before the body is read.
pub(super) async fn only_organizers(
    State(host): State<Arc<Host>>,
    mut request: Request,
    next: Next,
) -> Response {
    match host.auth.organizer(&host.store, request.headers()).await {
        Ok(identity) => {
            request.extensions_mut().insert(identity);
            next.run(request).await
        }
        Err(refusal) => Problem(refusal).into_response(),
    }
}
