//! Passes an organizer's request on to the host that has the session, in a fleet.

use crate::session::Sessions;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, HOST};
use axum::http::{Method, Response, Uri};
use axum::middleware::Next;
use axum::response::IntoResponse;
use hyper_util::rt::TokioIo;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_store::Store;
use serde_json::Value;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::timeout;

/// Addresses whose requests are about one session or one of its runs.
const PATHS: [&str; 2] = ["/v1/admin/session/", "/v1/admin/run/"];
/// Marks a request that another host has passed on: it is not passed on again.
const PASSED_ON: &str = "palmares-passed-on";
/// Longest body of such a request, bytes.
const BODY_BYTES: usize = 1 << 16;
/// Longest wait for the other host.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Answers here, or passes the request on to the owner of its session.
pub(in crate::http) async fn to_owner(
    State(store): State<Store>,
    State(sessions): State<Arc<Sessions>>,
    request: Request,
    next: Next,
) -> axum::response::Response {
    let about_one = request.method() == Method::POST
        && PATHS.iter().any(|path| request.uri().path().starts_with(path))
        && !request.headers().contains_key(PASSED_ON);
    if store.host_name().is_none() || !about_one {
        return next.run(request).await;
    }
    let (parts, body) = request.into_parts();
    let Ok(bytes) = to_bytes(body, BODY_BYTES).await else {
        return Problem::new(Code::TooLarge, format!("a body may have at most {BODY_BYTES} bytes"))
            .into_response();
    };
    let owner = match subject(&bytes) {
        Some((session_id, _))
            if sessions.registry.held().iter().any(|held| held.session_id == session_id) =>
        {
            Ok(None)
        }
        Some((session_id, run_id)) => store.owner_elsewhere(&session_id, &run_id).await,
        None => Ok(None),
    };
    match owner {
        Ok(None) => next.run(Request::from_parts(parts, Body::from(bytes))).await,
        Ok(Some((host, Some(url)))) => {
            let mut passed_on = Request::builder().method(Method::POST).uri(parts.uri.path());
            for name in [AUTHORIZATION, CONTENT_TYPE] {
                if let Some(value) = parts.headers.get(&name) {
                    passed_on = passed_on.header(name, value);
                }
            }
            let sent = timeout(TIMEOUT, send(&url, passed_on.header(PASSED_ON, "1"), bytes)).await;
            match sent {
                Ok(Ok(response)) => response,
                Ok(Err(error)) => unreachable_host(&host, &error.to_string()),
                Err(_) => unreachable_host(&host, "it does not answer"),
            }
        }
        Ok(Some((host, None))) => unreachable_host(&host, "it has no internal_url in [fleet]"),
        Err(error) => Problem::from(error).into_response(),
    }
}

fn unreachable_host(host: &str, why: &str) -> axum::response::Response {
    let message = format!("the session is at the host `{host}`, which cannot be reached ({why}); try again");
    Problem::new(Code::Internal, message).into_response()
}

/// Ids of the session and the run in a body; empty where they are missing.
fn subject(bytes: &Bytes) -> Option<(String, String)> {
    let body: Value = serde_json::from_slice(bytes).ok()?;
    let text = |field: &str| body.get(field).and_then(Value::as_str).unwrap_or_default().to_owned();
    Some((text("session_id"), text("run_id")))
}

/// Sends the request to the server at this URL.
async fn send(
    url: &str,
    request: axum::http::request::Builder,
    bytes: Bytes,
) -> anyhow::Result<axum::response::Response> {
    let uri: Uri = url.parse()?;
    let authority = uri.authority().map(ToString::to_string).unwrap_or_default();
    let address = (uri.host().unwrap_or_default().to_owned(), uri.port_u16().unwrap_or(80));
    let socket = TokioIo::new(TcpStream::connect(address).await?);
    let (mut sender, connection) = hyper::client::conn::http1::handshake(socket).await?;
    tokio::spawn(connection);
    let request = request.header(HOST, authority).body(Body::from(bytes))?;
    let response: Response<_> = sender.send_request(request).await?;
    Ok(response.map(Body::new).into_response())
}
