//! The handshake of a viewer's connection: its identity and its subprotocol.

use super::access::Watcher;
use super::context::WatchContext;
use super::viewer::Viewer;
use crate::auth::{Identity, Role};
use crate::config::settings::MESSAGE_BYTES;
use crate::problem::Problem;
use crate::transport::Caller;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{ConnectInfo, State};
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Response};
use palmares_protocol::{Code, Encoding, Refusal};

/// The subprotocol with binary frames of poses.
const BINARY: &str = "palmares.v1.bin";

/// `GET /v1/watch`.
pub(crate) async fn watch(
    State(context): State<WatchContext>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    let refuse = |refusal: Refusal| Problem(refusal).into_response();
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade.protocols([BINARY, Encoding::Json.subprotocol()]),
        Err(rejection) => {
            let message = format!("this address expects a WebSocket: {}", rejection.body_text());
            return refuse(Refusal::new(Code::BadRequest, message));
        }
    };
    let Some(protocol) = upgrade.selected_protocol() else {
        let known = Encoding::Json.subprotocol();
        let message = format!("offer the WebSocket subprotocol {known} or {BINARY} (Sec-WebSocket-Protocol)");
        return refuse(Refusal::new(Code::BadRequest, message));
    };
    let binary = protocol == BINARY;
    let identity = match context.auth.identify_browser(&context.store, &headers).await {
        Ok(identity) => identity,
        Err(refusal) => return refuse(refusal),
    };
    let Some(permit) = context.hub.viewer_permit() else {
        let message = "all places for viewers are taken";
        return refuse(Refusal::new(Code::Capacity, message).retry_after(5.0));
    };
    let watcher = match &identity {
        None => Watcher::Anybody,
        Some(Identity { role: Role::Organizer, .. }) => Watcher::Organizer,
        Some(Identity { role: Role::Viewer, .. }) => Watcher::Spectator,
        Some(Identity { role: Role::Team, team, .. }) => Watcher::Team(team.clone().unwrap_or_default()),
    };
    upgrade.max_message_size(MESSAGE_BYTES).max_frame_size(MESSAGE_BYTES).on_upgrade(async move |socket| {
        let (_permit, _caller) = (permit, caller);
        let _alive = context.lifecycle.alive();
        Viewer::new(socket, context, watcher, binary).serve(identity.as_ref()).await;
    })
}
