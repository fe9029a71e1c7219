//! Errors as `application/problem+json` (RFC 9457) with the protocol's codes.

use axum::http::{HeaderName, HeaderValue, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use palmares_metrics::METRICS;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_store::StoreError;
use schemars::JsonSchema;
use serde::Serialize;

/// A refusal as an HTTP response.
#[derive(Debug)]
pub struct Problem(pub Refusal);

/// An error, RFC 9457.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Problem")]
pub struct ProblemBody<'a> {
    /// Always `about:blank`: the codes have no pages of their own.
    r#type: &'static str,
    title: &'a str,
    status: u16,
    detail: &'a str,
    code: Code,
    #[serde(skip_serializing_if = "Option::is_none")]
    retry_after_s: Option<f64>,
}

fn respond(status: StatusCode, refusal: &Refusal) -> Response {
    METRICS.refused(refusal.code);
    let body = ProblemBody {
        r#type: "about:blank",
        title: status.canonical_reason().unwrap_or_default(),
        status: status.as_u16(),
        detail: &refusal.message,
        code: refusal.code,
        retry_after_s: refusal.retry_after_s,
    };
    // Strings and numbers: encoding cannot fail.
    let json = serde_json::to_string(&body).unwrap_or_default();
    let content_type: (HeaderName, &str) = (header::CONTENT_TYPE, "application/problem+json");
    let mut response = (status, [content_type], json).into_response();
    if let Some(seconds) = refusal.retry_after_s {
        response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds.ceil().max(1.0) as u64));
    }
    response
}

/// The HTTP status of a code.
fn status(code: Code) -> StatusCode {
    match code {
        Code::BadJson | Code::UnknownOp | Code::BadRequest | Code::BadAction => StatusCode::BAD_REQUEST,
        Code::StaleTick | Code::WrongState | Code::SessionTaken | Code::NotScheduled => StatusCode::CONFLICT,
        Code::UnknownTask | Code::UnknownHand | Code::UnknownCamera | Code::NotFound => StatusCode::NOT_FOUND,
        Code::NotAuthorized => StatusCode::UNAUTHORIZED,
        Code::TooSlow => StatusCode::REQUEST_TIMEOUT,
        Code::Forbidden => StatusCode::FORBIDDEN,
        Code::HandInTheWay => StatusCode::UNPROCESSABLE_ENTITY,
        Code::SessionOver => StatusCode::GONE,
        Code::Capacity => StatusCode::SERVICE_UNAVAILABLE,
        Code::RateLimited => StatusCode::TOO_MANY_REQUESTS,
        Code::TooLarge => StatusCode::PAYLOAD_TOO_LARGE,
        Code::Internal => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        respond(status(self.0.code), &self.0)
    }
}

/// The answer for an address that does not have this method.
pub fn method_not_allowed(method: &Method) -> Response {
    let message = format!("{method} is not possible here");
    respond(StatusCode::METHOD_NOT_ALLOWED, &Refusal::new(Code::BadRequest, message))
}

/// The answer to a WebSocket handshake of another version, with the version that is served (RFC 6455, section 4.4).
pub fn wrong_websocket_version() -> Response {
    let refusal = Refusal::new(Code::BadRequest, "Sec-WebSocket-Version: expected 13");
    let mut response = respond(StatusCode::UPGRADE_REQUIRED, &refusal);
    response.headers_mut().insert(header::SEC_WEBSOCKET_VERSION, HeaderValue::from_static("13"));
    response
}

/// The answer of a server that cannot do its work now.
pub fn not_ready(code: Code, why: &str) -> Response {
    respond(StatusCode::SERVICE_UNAVAILABLE, &Refusal::new(code, why))
}

/// The answer for an unknown address.
pub async fn nothing_here(uri: Uri) -> Problem {
    let message = format!("nothing at {}", shortened(uri.path()));
    Problem::new(Code::NotFound, message)
}

impl Problem {
    /// A problem with this code and message.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Problem(Refusal::new(code, message))
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        Problem(refusal)
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        Problem(error.into())
    }
}
