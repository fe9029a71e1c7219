//! The handshake of a control connection.

use super::connection::{self, ConnectionParts};
use crate::session::Sessions;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{ConnectInfo, State};
use axum::http::HeaderMap;
use axum::response::Response;
use palmares_net::auth::{Auth, Identity, Role, forbidden};
use palmares_net::transport::{self, Caller, InboundLimits, UpgradeRefused};
use palmares_protocol::{Encoding, Refusal};
use std::sync::Arc;

/// Messages up to this size are read whole, so that the answer `too_large` reaches the client; larger ones are not read.
const READ_BYTES: usize = 1 << 20;
/// Size of a read from the socket, bytes. The library zeroes its buffer before every read: its default of 128 KiB would evict
/// the world from the caches.
const BUFFER_BYTES: usize = 1 << 10;

/// `GET /v1/control`.
pub(crate) async fn control(
    State(inbound): State<Arc<InboundLimits>>,
    State(auth): State<Arc<Auth>>,
    State(sessions): State<Arc<Sessions>>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, UpgradeRefused> {
    let known = Encoding::ALL.map(|encoding| (encoding.subprotocol(), encoding));
    let (upgrade, encoding) = transport::upgrade(upgrade, &headers, known)?;
    // Before the upgrade: a client that may not play gets an HTTP answer.
    let identity = player(&auth, &sessions, &headers).await?;
    let permit = inbound.connections.take(identity.as_ref())?;
    let caller = caller.counted(&inbound)?;
    let parts = ConnectionParts { caller, encoding, sessions, auth, identity, permit };
    Ok(upgrade
        .read_buffer_size(BUFFER_BYTES)
        .max_message_size(READ_BYTES)
        .max_frame_size(READ_BYTES)
        .on_upgrade(async move |socket| connection::serve(socket, parts).await))
}

/// The player's identity; None without a token, which only practice allows.
async fn player(auth: &Auth, sessions: &Sessions, headers: &HeaderMap) -> Result<Option<Identity>, Refusal> {
    match auth.identify(&sessions.store, headers).await {
        Ok(None) if sessions.competition.rules.official() => {
            auth.require(&sessions.store, headers).await.map(Some)
        }
        Ok(Some(identity)) if identity.role != Role::Team => Err(forbidden("a team's token")),
        other => other,
    }
}
