//! Requests of organizers: the body, the identity, and the audit entry.

use crate::http::state::AppState;
use axum::body::Bytes;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::Extensions;
use axum::http::request::Parts;
use palmares_net::auth::Identity;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_store::{ListFilter, NewAuditEntry};
use serde::Deserialize;
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

/// Rows of a list in a response, if the request does not say how many, and at most.
pub(super) const MAX_ROWS: u32 = 1000;

/// The query of a list: which rows, and how many.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ListQuery {
    team: Option<String>,
    task: Option<String>,
    status: Option<String>,
    since_unix_ms: Option<i64>,
    until_unix_ms: Option<i64>,
    after: Option<String>,
    limit: Option<u32>,
}

impl ListQuery {
    /// The rows that it asks for.
    pub(super) fn filter(self, known_status: &[&str]) -> Result<ListFilter, Problem> {
        if let Some(status) = self.status.as_deref().filter(|status| !known_status.contains(status)) {
            let message =
                format!("status: no `{}`; there are {}", shortened(status), known_status.join(", "));
            return Err(Problem::new(Code::BadRequest, message));
        }
        Ok(ListFilter {
            team: self.team,
            task: self.task,
            status: self.status,
            since_unix_ms: self.since_unix_ms,
            until_unix_ms: self.until_unix_ms,
            after: self.after,
            limit: self.limit.unwrap_or(MAX_ROWS).min(MAX_ROWS),
        })
    }
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
