//! The reason why the WebSocket library refused a client's frame.

use std::error::Error;
use tungstenite::Error as SocketError;
use tungstenite::error::ProtocolError;

/// Protocol error, RFC 6455.
const CLOSE_PROTOCOL_ERROR: u16 = 1002;
/// Data of the wrong kind, RFC 6455.
const CLOSE_INVALID_DATA: u16 = 1007;

/// The reason why a connection yields no further message.
#[derive(Debug, PartialEq, Eq)]
pub enum FrameError {
    /// A message is too large.
    TooLarge,
    /// The client broke the protocol. Code and reason of the close frame.
    Violation(u16, String),
    /// The connection failed.
    Lost,
}

impl FrameError {
    /// The reason behind an error of a socket.
    pub fn of(error: &axum::Error) -> Self {
        let mut cause: Option<&(dyn Error + 'static)> = Some(error);
        while let Some(error) = cause {
            match error.downcast_ref() {
                Some(SocketError::Capacity(_)) => return FrameError::TooLarge,
                Some(SocketError::Protocol(ProtocolError::ResetWithoutClosingHandshake)) => {
                    return FrameError::Lost;
                }
                Some(SocketError::Protocol(why)) => {
                    return FrameError::Violation(CLOSE_PROTOCOL_ERROR, why.to_string());
                }
                Some(SocketError::Utf8(_)) => {
                    return FrameError::Violation(CLOSE_INVALID_DATA, "Text is not UTF-8".into());
                }
                _ => cause = error.source(),
            }
        }
        FrameError::Lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::Router;
    use axum::extract::ws::WebSocketUpgrade;
    use axum::routing::get;
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use tokio::sync::mpsc;

    /// Sends a WebSocket handshake and one masked frame; the connection closes when the result is dropped.
    fn sent(address: std::net::SocketAddr, first: u8, payload: &[u8]) -> TcpStream {
        let mut stream = TcpStream::connect(address).expect("it listens");
        let head = "GET / HTTP/1.1\r\nhost: a\r\nconnection: upgrade\r\nupgrade: websocket\r\nsec-websocket-version: 13\r\n\
                    sec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
        stream.write_all(head.as_bytes()).expect("open");
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).expect("an answer");
        assert_eq!(&answer, b"HTTP/1.1 101");
        let mut frame = vec![first, 0x80 | u8::try_from(payload.len()).expect("short"), 0, 0, 0, 0];
        frame.extend(payload);
        stream.write_all(&frame).expect("open");
        stream
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn an_error_of_the_library_is_known_by_its_type() {
        let (sender, mut received) = mpsc::unbounded_channel();
        let handler = async move |upgrade: WebSocketUpgrade| {
            let sender = sender.clone();
            upgrade.max_message_size(8).on_upgrade(async move |mut socket| {
                let message = socket.recv().await.expect("a message or an error");
                let _ = sender.send(message.as_ref().err().map(FrameError::of));
            })
        };
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("bound");
        let router: Router = Router::new().route("/", get(handler));
        let server = tokio::spawn(async move { axum::serve(listener, router).await });
        let violation = |code, reason: &str| Some(FrameError::Violation(code, reason.into()));
        for (first, payload, expected) in [
            (0x81, &b"aaaaaaaa"[..], None),
            (0x81, b"aaaaaaaaa", Some(FrameError::TooLarge)),
            (0x81, b"\xff", violation(1007, "Text is not UTF-8")),
            (0xc1, b"a", violation(1002, "Reserved bits are non-zero")),
        ] {
            let client =
                tokio::task::spawn_blocking(move || sent(address, first, payload)).await.expect("sent");
            assert_eq!(received.recv().await, Some(expected), "{first:#x} {payload:?}");
            drop(client);
        }
        server.abort();
        // The same words in an error of another type.
        let other = std::io::Error::other("Space limit exceeded: Message too long");
        assert_eq!(FrameError::of(&axum::Error::new(other)), FrameError::Lost);
    }
}
