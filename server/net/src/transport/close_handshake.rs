//! The closing handshake of a WebSocket (RFC 6455, section 7.1.2).

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket};
use std::time::Duration;
use tokio::time::timeout;

/// Longest time for the rest of the handshake: the client's answer to a close frame, or the sending of ours.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(2);

/// Sends a close frame and waits for the answer. Closing a socket with unread input would discard the messages that are still
/// on their way to the client.
pub async fn close_handshake(mut socket: WebSocket, code: u16, reason: impl Into<Utf8Bytes>) {
    let frame = CloseFrame { code, reason: reason.into() };
    let closing = async {
        if socket.send(Message::Close(Some(frame))).await.is_ok() {
            while let Some(Ok(_)) = socket.recv().await {}
        }
    };
    let _ = timeout(CLOSE_TIMEOUT, closing).await;
}

/// Answers the client's close frame. The library has prepared the answer and sends it with the next read.
pub async fn answer_close(mut socket: WebSocket) {
    let _ = timeout(CLOSE_TIMEOUT, async { while let Some(Ok(_)) = socket.recv().await {} }).await;
}
