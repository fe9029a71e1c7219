//! The opening handshake of a WebSocket (RFC 6455, section 4.2): the same checks for all sockets.

use crate::transport::problem::{Problem, wrong_websocket_version};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::http::HeaderMap;
use axum::http::header::SEC_WEBSOCKET_KEY;
use axum::response::{IntoResponse, Response};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use palmares_protocol::{Code, Refusal};

/// Bytes of a handshake's key.
const KEY_BYTES: usize = 16;

/// A handshake that is refused.
pub enum UpgradeRefused {
    /// The client speaks another version of the protocol.
    Version,
    /// Any other reason.
    Other(Refusal),
}

impl From<Refusal> for UpgradeRefused {
    fn from(refusal: Refusal) -> Self {
        UpgradeRefused::Other(refusal)
    }
}

impl IntoResponse for UpgradeRefused {
    fn into_response(self) -> Response {
        match self {
            UpgradeRefused::Version => wrong_websocket_version(),
            UpgradeRefused::Other(refusal) => Problem(refusal).into_response(),
        }
    }
}

/// Checks a handshake; returns the upgrade and the meaning of its subprotocol. `known` has the subprotocols, the preferred one
/// first.
///
/// # Errors
/// The request is no valid handshake, or offers no known subprotocol.
pub fn upgrade<T>(
    requested: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
    headers: &HeaderMap,
    known: [(&'static str, T); 2],
) -> Result<(WebSocketUpgrade, T), UpgradeRefused> {
    let refused = |message: String| UpgradeRefused::Other(Refusal::new(Code::BadRequest, message));
    let names = known.each_ref().map(|(name, _)| *name);
    let upgrade = match requested {
        Ok(upgrade) => upgrade.protocols(names),
        Err(WebSocketUpgradeRejection::InvalidWebSocketVersionHeader(_)) => {
            return Err(UpgradeRefused::Version);
        }
        Err(rejection) => {
            return Err(refused(format!("this address expects a WebSocket: {}", rejection.body_text())));
        }
    };
    let key = headers.get(SEC_WEBSOCKET_KEY).and_then(|key| STANDARD.decode(key.as_bytes()).ok());
    if key.is_none_or(|key| key.len() != KEY_BYTES) {
        return Err(refused(format!("Sec-WebSocket-Key: expected {KEY_BYTES} bytes in Base64")));
    }
    let chosen = upgrade.selected_protocol().cloned();
    let chosen = known.into_iter().find(|(name, _)| chosen.as_ref().is_some_and(|chosen| chosen == name));
    match chosen {
        Some((_, meaning)) => Ok((upgrade, meaning)),
        None => {
            let names = names.join(" or ");
            Err(refused(format!("offer the WebSocket subprotocol {names} (Sec-WebSocket-Protocol)")))
        }
    }
}
