//! The handshake of a viewer's connection: its identity and its subprotocol.

use super::access::Watcher;
use super::context::WatchContext;
use super::viewer::Viewer;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{ConnectInfo, State};
use axum::http::HeaderMap;
use axum::response::Response;
use palmares_net::auth::{Identity, Role};
use palmares_net::config::settings::MESSAGE_BYTES;
use palmares_net::transport::{self, Caller, InboundLimits, UpgradeRefused};
use palmares_protocol::Encoding;
use std::sync::Arc;

/// The subprotocol with binary frames of poses.
const BINARY: &str = "palmares.v1.bin";

/// `GET /v1/watch`.
pub(crate) async fn watch(
    State(context): State<WatchContext>,
    State(inbound): State<Arc<InboundLimits>>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, UpgradeRefused> {
    let known = [(BINARY, true), (Encoding::Json.subprotocol(), false)];
    let (upgrade, binary) = transport::upgrade(upgrade, &headers, known)?;
    let identity = context.auth.identify_browser(&context.store, &headers).await?;
    let watcher = match &identity {
        None => Watcher::Anybody,
        Some(Identity { role: Role::Organizer, .. }) => Watcher::Organizer,
        Some(Identity { role: Role::Viewer, .. }) => Watcher::Spectator,
        Some(Identity { role: Role::Team, team, .. }) => Watcher::Team(team.clone().unwrap_or_default()),
    };
    let place = context.hub.places.take(&watcher, context.competition.settings.max_connections_per_team)?;
    let caller = caller.counted(&inbound)?;
    let upgrade = upgrade.max_message_size(MESSAGE_BYTES).max_frame_size(MESSAGE_BYTES);
    Ok(upgrade.on_upgrade(async move |socket| {
        let (_place, _caller) = (place, caller);
        let _alive = context.lifecycle.alive();
        Viewer::new(socket, context, watcher, binary).serve(identity.as_ref()).await;
    }))
}
