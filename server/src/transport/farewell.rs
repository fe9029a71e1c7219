//! The end of a WebSocket.

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket};
use std::time::Duration;
use tokio::time::timeout;

/// How long a caller may take to answer a close frame; one that does not is left.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(2);

/// Says why, and waits a little for the caller to have read it: closing a socket with unread input would throw away what is
/// on its way to the caller.
pub(crate) async fn farewell(mut socket: WebSocket, code: u16, reason: &'static str) {
    let frame = CloseFrame { code, reason: Utf8Bytes::from_static(reason) };
    let told = async {
        if socket.send(Message::Close(Some(frame))).await.is_ok() {
            while let Some(Ok(_)) = socket.recv().await {}
        }
    };
    let _ = timeout(CLOSE_TIMEOUT, told).await;
}
