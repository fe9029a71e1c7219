//! The handshake of a control connection.

use super::connection::{self, Parts};
use crate::auth::{Auth, Identity, Role, forbidden};
use crate::problem::Problem;
use crate::session::Sessions;
use crate::transport::{Caller, InboundLimits};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{ConnectInfo, State};
use axum::http::HeaderMap;
use axum::response::Response;
use palmares_protocol::{Code, Encoding, Refusal};
use std::sync::Arc;

/// Inbound messages up to here are read whole, so that the answer `too_large` reaches the client; what is
/// larger still is not read.
const READ_BYTES: usize = 1 << 20;
/// Bytes read from the socket at once. The library fills its buffer with zeros before every look at the socket: its
/// 128 KiB would clear the caches of the world that is stepped in between.
const AT_ONCE_BYTES: usize = 1 << 10;

/// `GET /v1/control`.
pub(crate) async fn control(
    State(inbound): State<Arc<InboundLimits>>,
    State(auth): State<Arc<Auth>>,
    State(sessions): State<Arc<Sessions>>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Problem> {
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade.protocols(Encoding::ALL.map(Encoding::subprotocol)),
        Err(rejection) => {
            let message = format!("this address speaks WebSocket: {}", rejection.body_text());
            return Err(Problem::new(Code::BadRequest, message));
        }
    };
    let chosen = upgrade.selected_protocol().and_then(|name| Encoding::of(name.to_str().ok()?));
    let Some(encoding) = chosen else {
        let known = Encoding::ALL.map(Encoding::subprotocol).join(" or ");
        let message = format!("offer the WebSocket subprotocol {known} (Sec-WebSocket-Protocol)");
        return Err(Problem::new(Code::BadRequest, message));
    };
    // Before the upgrade: who may not play gets an HTTP answer and no socket.
    let identity = player(&auth, &sessions, &headers).await?;
    let permit = inbound.connections.take(identity.as_ref())?;
    let parts = Parts { caller, encoding, sessions, auth, identity, permit };
    Ok(upgrade
        .read_buffer_size(AT_ONCE_BYTES)
        .max_message_size(READ_BYTES)
        .max_frame_size(READ_BYTES)
        .on_upgrade(async move |socket| connection::serve(socket, parts).await))
}

/// Who plays; in practice also somebody without a token.
async fn player(auth: &Auth, sessions: &Sessions, headers: &HeaderMap) -> Result<Option<Identity>, Refusal> {
    match auth.identify(&sessions.store, headers).await {
        Ok(None) if sessions.competition.rules.official() => {
            auth.require(&sessions.store, headers).await.map(Some)
        }
        Ok(Some(identity)) if identity.role != Role::Team => Err(forbidden("a team's token")),
        other => other,
    }
}
