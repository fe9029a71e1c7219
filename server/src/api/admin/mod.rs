//! What organizers do: teams and tokens, the competition's phases, sessions, runs, hands, exports.
//!
//! Every address is `POST /v1/admin/<noun>/<verb>` with a JSON body, or a GET for what only looks. The ids
//! of what is acted on stand in bodies, not in paths. Every action leaves an audit entry with its reason.

pub(super) mod competition;
pub(super) mod export;
pub(super) mod hands;
pub(super) mod runs;
pub(super) mod sessions;
pub(super) mod teams;

use super::Problem;
use super::rest::store_failed;
use crate::app::App as Host;
use crate::auth::Identity;
use crate::protocol::{Code, Refusal};
use crate::store::NewAuditEntry;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{FromRequest, Request, State};
use axum::http::request::Parts;
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// The organizers' addresses.
pub(super) fn router(host: &Host) -> Router<Host> {
    Router::new()
        .route("/v1/admin/competition/{verb}", post(competition::enter))
        .route("/v1/admin/team/add", post(teams::add))
        .route("/v1/admin/team/rotate", post(teams::rotate))
        .route("/v1/admin/team/revoke", post(teams::revoke))
        .route("/v1/admin/teams", get(teams::list))
        .route("/v1/admin/token/add", post(teams::add_token))
        .route("/v1/admin/token/revoke", post(teams::revoke_token))
        .route("/v1/admin/tokens", get(teams::tokens))
        .route("/v1/admin/session/{verb}", post(sessions::act))
        .route("/v1/admin/run/{verb}", post(runs::act))
        .route("/v1/admin/hands", get(hands::list))
        .route("/v1/admin/hands/{id}", get(hands::show))
        .route("/v1/admin/hands/{id}/archive", get(hands::archive))
        .route("/v1/admin/hand/{verb}", post(hands::decide))
        .route("/v1/admin/audit", get(export::audit))
        .route("/v1/admin/export/{what}", get(export::export))
        .route("/v1/admin/backup", get(export::backup))
        .route_layer(middleware::from_fn_with_state(host.clone(), only_organizers))
}

/// Lets organizers through, and tells the addresses who they are. Runs before the body is read.
async fn only_organizers(State(host): State<Arc<Host>>, mut request: Request, next: Next) -> Response {
    match host.auth.organizer(&host.store, request.headers()).await {
        Ok(identity) => {
            request.extensions_mut().insert(identity);
            next.run(request).await
        }
        Err(refusal) => Problem(refusal).into_response(),
    }
}

/// A JSON body whose errors are problems; and whose it is.
pub(super) struct Asked<T> {
    /// Who asks.
    pub(super) identity: Identity,
    /// What.
    pub(super) body: T,
}

impl<T: DeserializeOwned> FromRequest<Host> for Asked<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, host: &Host) -> Result<Self, Problem> {
        let identity = identity_of(request.extensions())?;
        let bad = |message: String| Problem(Refusal::new(Code::BadRequest, message));
        let bytes = Bytes::from_request(request, host).await.map_err(|error| bad(error.body_text()))?;
        let text = if bytes.is_empty() { b"{}".as_slice() } else { &bytes };
        let mut json = serde_json::Deserializer::from_slice(text);
        let body =
            serde_path_to_error::deserialize(&mut json).map_err(|error| bad(format!("body: {error}")))?;
        Ok(Asked { identity, body })
    }
}

fn identity_of(extensions: &axum::http::Extensions) -> Result<Identity, Problem> {
    // The middleware has put it there.
    let missing = || Problem(Refusal::new(Code::Internal, "the request has no identity"));
    extensions.get().cloned().ok_or_else(missing)
}

impl axum::extract::FromRequestParts<Host> for Identity {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &Host) -> Result<Self, Problem> {
        identity_of(&parts.extensions)
    }
}

/// An audit entry of this organizer.
fn entry<'a>(
    identity: &'a Identity,
    action: &'a str,
    subject: &'a str,
    reason: &'a Option<String>,
) -> NewAuditEntry<'a> {
    NewAuditEntry { actor: &identity.token_id, action, subject, reason: reason.as_deref() }
}

/// Something that needs a reason has none.
fn needs_reason(reason: &Option<String>) -> Result<(), Problem> {
    match reason.as_deref().map(str::trim) {
        Some(text) if !text.is_empty() => Ok(()),
        _ => Err(Problem(Refusal::new(Code::BadRequest, "reason: say why; it is kept in the audit"))),
    }
}

fn not_found(message: String) -> Problem {
    Problem(Refusal::new(Code::NotFound, message))
}

fn no_verb(verb: &str, known: &str) -> Problem {
    not_found(format!("no `{}`; there are {known}", crate::protocol::request::shortened(verb)))
}
