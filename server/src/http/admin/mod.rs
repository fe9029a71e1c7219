//! What organizers do: teams and tokens, the competition's phases, sessions, runs, hands, exports.
//!
//! Every address is `POST /v1/admin/<noun>/<verb>` with a JSON body, or a GET for what only looks. The ids
//! of what is acted on stand in bodies, not in paths. Every action leaves an audit entry with its reason.

mod announcement;
mod competition;
mod export;
mod hands;
mod request;
mod runs;
mod sessions;
mod teams;

use super::openapi::operation::{Token, ZIP, get, get_json, post_json};
use super::openapi::routes::Routes;
use crate::auth::Auth;
use crate::problem::Problem;
use crate::state::AppState;
use crate::store::{Announcement, Store};
use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};
use std::sync::Arc;
use teams::{Issued, Revoked, TeamBody, Teams, TokenBody, TokenId, Tokens};

/// The organizers' addresses.
pub(super) fn routes() -> Routes<AppState> {
    Routes::of(Token::Organizer)
        .add(
            post_json::<competition::Body, competition::Answer>(
                "/v1/admin/competition/{verb}",
                "Let sessions begin, let no further one begin, end it for good and \
                 publish the secret of the seeds",
            )
            .words(&["open", "close", "reveal"]),
            competition::enter,
        )
        .add(
            post_json::<announcement::Body, Announcement>(
                "/v1/admin/announcement",
                "Tell everybody something, on the pages and on the watch socket",
            ),
            announcement::announce,
        )
        .add(post_json::<TeamBody, Issued>("/v1/admin/team/add", "Add a team; answers its token"), teams::add)
        .add(
            post_json::<TeamBody, Issued>(
                "/v1/admin/team/rotate",
                "Give a team a new token instead of the old",
            ),
            teams::rotate,
        )
        .add(
            post_json::<TeamBody, Revoked>("/v1/admin/team/revoke", "Take a team's tokens back"),
            teams::revoke,
        )
        .add(get_json::<Teams>("/v1/admin/teams", "The teams"), teams::list)
        .add(
            post_json::<TokenBody, Issued>(
                "/v1/admin/token/add",
                "Make a token for an organizer or a viewer",
            ),
            teams::add_token,
        )
        .add(
            post_json::<TokenId, Revoked>("/v1/admin/token/revoke", "Take a token back"),
            teams::revoke_token,
        )
        .add(get_json::<Tokens>("/v1/admin/tokens", "The tokens without their secrets"), teams::tokens)
        .add(
            post_json::<sessions::Body, sessions::Answer>(
                "/v1/admin/session/{verb}",
                "Hold a session, let it go on, end it, void it, give it time",
            )
            .words(&["pause", "resume", "end", "void", "grant"]),
            sessions::act,
        )
        .add(
            post_json::<runs::Body, runs::Answer>(
                "/v1/admin/run/{verb}",
                "Void a run and give its time back, or have its replay played again",
            )
            .words(&["void", "reverify"]),
            runs::act,
        )
        .add(get_json::<hands::List>("/v1/admin/hands", "The hands of all teams"), hands::list)
        .add(
            get_json::<hands::Shown>(
                "/v1/admin/hands/{id}",
                "A hand's figures beside those of the program's hands and the limits",
            ),
            hands::show,
        )
        .add(get("/v1/admin/hands/{id}/archive", "A hand's archive, as it was sent in", ZIP), hands::archive)
        .add(
            post_json::<hands::Body, hands::Decided>(
                "/v1/admin/hand/{verb}",
                "Let a team play a hand of its own officially, or do not",
            )
            .words(&["approve", "reject"]),
            hands::decide,
        )
        .add(
            get_json::<export::Records>("/v1/admin/audit", "Who decided what, when and why")
                .query("after", "Only records after this number")
                .query("limit", "At most so many, 1000 if left out, and never more"),
            export::audit,
        )
        .add(
            get_json::<Vec<Map<String, Value>>>("/v1/admin/export/{what}", "A table, whole: a list of rows")
                .words(&["leaderboard", "sessions", "runs", "audit"])
                .query("format", "json or csv"),
            export::export,
        )
        .add(get("/v1/admin/backup", "Everything as one archive, secrets included", ZIP), export::backup)
}

/// Lets organizers through, and tells the addresses who they are. Runs before the body is read.
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
