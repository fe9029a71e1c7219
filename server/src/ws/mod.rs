//! WebSockets.

mod busy_poll;
mod connection;
mod local;
mod rate;
mod wire;

pub(crate) use busy_poll::Awake;
pub(crate) use wire::{Caller, WireListener};

use crate::auth::{Role, forbidden};
use crate::http::Problem;
use crate::protocol::{Code, Encoding, Refusal};
use crate::session::Host;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{ConnectInfo, State};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Inbound messages up to here are read whole, so that the answer `too_large` reaches the client; what is
/// larger still is not read.
const READ_BYTES: usize = 1 << 20;
/// Bytes read from the socket at once. The library fills its buffer with zeros before every look at the socket: its
/// 128 KiB would clear the caches of the world that is stepped in between.
const AT_ONCE_BYTES: usize = 1 << 10;

/// `GET /v1/control`.
pub(crate) async fn control(
    State(host): State<Arc<Host>>,
    ConnectInfo(Caller { attention, local, .. }): ConnectInfo<Caller>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade.protocols(Encoding::ALL.map(Encoding::subprotocol)),
        Err(rejection) => {
            let message = format!("this address speaks WebSocket: {}", rejection.body_text());
            return Problem(Refusal::new(Code::BadRequest, message)).into_response();
        }
    };
    let chosen = upgrade.selected_protocol().and_then(|name| Encoding::of(name.to_str().ok()?));
    let Some(encoding) = chosen else {
        let known = Encoding::ALL.map(Encoding::subprotocol).join(" or ");
        let message = format!("offer the WebSocket subprotocol {known} (Sec-WebSocket-Protocol)");
        return Problem(Refusal::new(Code::BadRequest, message)).into_response();
    };
    // Before the upgrade: who may not play gets an HTTP answer and no socket.
    let identity = match host.auth.identify(&host.store, &headers).await {
        Ok(None) if host.rules.official() => host.auth.require(&host.store, &headers).await.map(Some),
        Ok(Some(identity)) if identity.role != Role::Team => Err(forbidden("a team's token")),
        other => other,
    };
    let identity = match identity {
        Ok(identity) => identity,
        Err(refusal) => return Problem(refusal).into_response(),
    };
    let place = match host.place_for_connection(identity.as_ref()) {
        Ok(place) => place,
        Err(refusal) => return Problem(refusal).into_response(),
    };
    let mut response = upgrade
        .read_buffer_size(AT_ONCE_BYTES)
        .max_message_size(READ_BYTES)
        .max_frame_size(READ_BYTES)
        .on_upgrade(async move |socket| {
            connection::serve(socket, attention, encoding, host, identity, place).await;
        });
    if let Some(name) = local.and_then(|name| HeaderValue::from_str(&name).ok()) {
        response.headers_mut().insert(local::HEADER, name);
    }
    response
}
