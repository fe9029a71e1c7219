//! Requests of organizers: the body, the identity, and the audit entry.

use crate::auth::Identity;
use crate::problem::Problem;
use crate::state::AppState;
use crate::store::NewAuditEntry;
use axum::body::Bytes;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::Extensions;
use axum::http::request::Parts;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use serde::de::DeserializeOwned;

/// A JSON body, whose errors are problems, with the organizer's identity.
pub(super) struct AdminRequest<T> {
    /// The organizer.
    pub(super) identity: Identity,
    /// The body.
    pub(super) body: T,
}

impl<T: DeserializeOwned> FromRequest<AppState> for AdminRequest<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, app: &AppState) -> Result<Self, Problem> {
        let identity = identity_of(request.extensions())?;
        let bad = |message: String| Problem::new(Code::BadRequest, message);
        let bytes = Bytes::from_request(request, app).await.map_err(|error| bad(error.body_text()))?;
        let text = if bytes.is_empty() { b"{}".as_slice() } else { &bytes };
        let mut json = serde_json::Deserializer::from_slice(text);
        let body =
            serde_path_to_error::deserialize(&mut json).map_err(|error| bad(format!("body: {error}")))?;
        Ok(AdminRequest { identity, body })
    }
}

fn identity_of(extensions: &Extensions) -> Result<Identity, Problem> {
    // The middleware has added it.
    let missing = || Problem::new(Code::Internal, "the request has no identity");
    extensions.get().cloned().ok_or_else(missing)
}

impl FromRequestParts<AppState> for Identity {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &AppState) -> Result<Self, Problem> {
        identity_of(&parts.extensions)
    }
}

/// An audit entry of this organizer.
pub(super) fn entry<'a>(
    identity: &'a Identity,
    action: &'a str,
    subject: &'a str,
    reason: &'a Option<String>,
) -> NewAuditEntry<'a> {
    NewAuditEntry { actor: &identity.token_id, action, subject, reason: reason.as_deref() }
}

/// Refuses a request without a reason.
pub(super) fn needs_reason(reason: &Option<String>) -> Result<(), Problem> {
    match reason.as_deref().map(str::trim) {
        Some(text) if !text.is_empty() => Ok(()),
        _ => Err(Problem::new(Code::BadRequest, "reason: say why; it is kept in the audit")),
    }
}

pub(super) fn not_found(message: String) -> Problem {
    Problem::new(Code::NotFound, message)
}

pub(super) fn no_verb(verb: &str, known: &str) -> Problem {
    not_found(format!("no `{}`; there are {known}", shortened(verb)))
}
