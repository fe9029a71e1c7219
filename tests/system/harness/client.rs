//! A client that can also misbehave.

use super::Server;
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::{HeaderValue, Request};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// A test that waits longer than this hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// A control connection.
pub(crate) struct Client {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    next_id: u64,
}

/// A handshake for the control socket that offers `protocols`.
pub(crate) fn handshake(server: &Server, protocols: Option<&str>) -> Request<()> {
    handshake_to(server, "/v1/control", protocols)
}

/// A handshake for any socket.
pub(crate) fn handshake_to(server: &Server, path: &str, protocols: Option<&str>) -> Request<()> {
    let url = format!("ws://{}{path}", server.address());
    let mut request = url.into_client_request().expect("request");
    if let Some(protocols) = protocols {
        let value = HeaderValue::from_str(protocols).expect("header");
        request.headers_mut().insert("Sec-WebSocket-Protocol", value);
    }
    request
}

impl Client {
    /// A connection without a message yet.
    pub(crate) async fn connect(server: &Server) -> Self {
        Self::connect_to(server, "/v1/control").await
    }

    /// The same to any socket.
    pub(crate) async fn connect_to(server: &Server, path: &str) -> Self {
        let request = handshake_to(server, path, Some("palmares.v1.json"));
        let (socket, _) = connect_async(request).await.expect("connects");
        Client { socket, next_id: 1 }
    }

    /// A connection that is open already.
    pub(super) fn over(socket: WebSocketStream<MaybeTlsStream<TcpStream>>) -> Self {
        Client { socket, next_id: 1 }
    }

    /// A connection that has said hello; and the welcome.
    pub(crate) async fn greet(server: &Server, team: &str) -> (Self, Value) {
        let mut client = Self::connect(server).await;
        let welcome = client.ask(json!({"op": "hello", "client": {"name": team}})).await;
        assert_eq!(welcome["op"], "welcome", "{welcome}");
        (client, welcome)
    }

    /// A connection with an open run at tick 0; and the welcome.
    pub(crate) async fn playing(server: &Server, team: &str) -> (Self, Value) {
        let (mut client, welcome) = Self::greet(server, team).await;
        let obs = client.ask(super::reset()).await;
        assert_eq!((&obs["op"], &obs["tick"]), (&json!("obs"), &json!(0)), "{obs}");
        (client, welcome)
    }

    /// A new connection that resumes a session; and the welcome.
    pub(crate) async fn resume(server: &Server, token: &Value) -> (Self, Value) {
        let mut client = Self::connect(server).await;
        let hello = json!({"op": "hello", "client": {"name": "again"}, "resume_token": token});
        let reply = client.ask(hello).await;
        (client, reply)
    }

    /// Sends a request with the next id; returns the reply, whose id must be the same.
    pub(crate) async fn ask(&mut self, mut request: Value) -> Value {
        let id = self.next_id;
        self.next_id += 1;
        request["id"] = id.into();
        self.send(&request.to_string()).await;
        let mut reply = self.next().await;
        while reply["op"] == "warning" || (reply["op"] == "obs" && reply.get("id").is_none()) {
            reply = self.next().await;
        }
        assert_eq!(reply["id"], id, "{request} was answered by {reply}");
        reply
    }

    /// Sends a request until the server has room for it.
    pub(crate) async fn settled(&mut self, request: Value) -> Value {
        loop {
            let reply = self.ask(request.clone()).await;
            if reply["code"] != "capacity" {
                return reply;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// The next observation that is no reply.
    pub(crate) async fn streamed(&mut self) -> Value {
        let mut message = self.next().await;
        while message["op"] != "obs" {
            message = self.next().await;
        }
        assert!(message.get("id").is_none(), "{message}");
        message
    }

    /// Takes all messages, and answers pings, for a while.
    pub(crate) async fn listen_for(&mut self, span: Duration) {
        let end = tokio::time::Instant::now() + span;
        while let Ok(message) = tokio::time::timeout_at(end, self.socket.next()).await {
            assert!(matches!(message, Some(Ok(_))), "{message:?}");
        }
    }

    /// Sends a request that must be refused, and not fatally; returns the error.
    pub(crate) async fn refused(&mut self, request: Value, code: &str) -> Value {
        let reply = self.ask(request).await;
        assert_error(&reply, code, false);
        reply
    }

    /// Sends a text frame as it is.
    pub(crate) async fn send(&mut self, text: &str) {
        self.send_message(Message::text(text)).await;
    }

    /// Sends a text frame to a server that may not want all of it.
    pub(crate) async fn try_send(&mut self, text: &str) {
        let _ = timeout(PATIENCE, self.socket.send(Message::text(text))).await.expect("in time");
    }

    /// Sends any frame.
    pub(crate) async fn send_message(&mut self, message: Message) {
        timeout(PATIENCE, self.socket.send(message)).await.expect("in time").expect("sent");
    }

    /// The next message from the server.
    pub(crate) async fn next(&mut self) -> Value {
        match self.next_or_closed().await {
            Ok(message) => message,
            Err(closed) => panic!("expected a message, got the close frame {closed:?}"),
        }
    }

    /// The next message from the server, or code and reason of its close frame.
    pub(crate) async fn next_or_closed(&mut self) -> Result<Value, (u16, String)> {
        loop {
            match timeout(PATIENCE, self.socket.next()).await.expect("in time") {
                Some(Ok(Message::Text(text))) => return Ok(serde_json::from_str(&text).expect("JSON")),
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Close(Some(frame)))) => {
                    return Err((frame.code.into(), frame.reason.to_string()));
                }
                other => panic!("expected a message, got {other:?}"),
            }
        }
    }

    /// Code and reason of the close frame that comes next.
    pub(crate) async fn closed(&mut self) -> (u16, String) {
        loop {
            match timeout(PATIENCE, self.socket.next()).await.expect("in time") {
                Some(Ok(Message::Close(Some(frame)))) => {
                    return (frame.code.into(), frame.reason.to_string());
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                other => panic!("expected a close frame, got {other:?}"),
            }
        }
    }

    /// One step from `tick`, which must succeed: the run is unharmed.
    pub(crate) async fn goes_on(&mut self, tick: u64) {
        let obs = self.ask(super::step(tick)).await;
        assert_eq!((&obs["op"], &obs["tick"]), (&json!("obs"), &json!(tick + 1)), "{obs}");
    }
}

/// Checks an error message.
pub(crate) fn assert_error(reply: &Value, code: &str, fatal: bool) {
    assert_eq!(reply["op"], "error", "{reply}");
    assert_eq!(reply["code"], code, "{reply}");
    assert_eq!(reply["fatal"], fatal, "{reply}");
    assert!(reply["message"].as_str().is_some_and(|message| !message.is_empty()), "{reply}");
}
