//! The end of a control connection: the fate of its session, the last message, and the close frame.

use crate::session::{Handover, Session};
use axum::extract::ws::WebSocket;
use palmares_net::transport::{answer_close, close_handshake};
use palmares_protocol::{Code, Refusal, Reply};
use palmares_tasks::Reason;
use std::time::Duration;

/// Normal closure, RFC 6455.
const CLOSE_NORMAL: u16 = 1000;
/// The server is going away, RFC 6455.
const CLOSE_AWAY: u16 = 1001;
/// The server restarts, or another one continues: connect again. RFC 6455's registry.
const CLOSE_RESTART: u16 = 1012;

/// Longest wait for a client to take the error that another connection has its session: it is probably gone.
const REPLACED_TIMEOUT: Duration = Duration::from_secs(2);

/// Reason why a connection ends or moves to a thread of its own.
#[derive(Debug)]
pub(super) enum ConnectionEnd {
    /// A session has begun.
    Greeted,
    /// The client is gone.
    Lost,
    /// The client closed the connection.
    Closed,
    /// The client broke the WebSocket protocol: code and reason of the close frame.
    Violation(u16, String),
    /// The client said `bye`.
    Bye,
    /// A fatal error that was sent to the client.
    Fatal(Code),
    /// The server shuts down.
    Stopping,
    /// An organizer ended the session.
    Ended,
    /// The session continues with another owner.
    Moved,
    /// The client has a new connection, which gets the session.
    Replaced(Handover),
}

/// The fate of a session whose connection ends.
#[derive(Debug)]
pub(super) enum SessionFate {
    /// It waits for its client.
    Park,
    /// The client has left it.
    Leave,
    /// It is over.
    End,
    /// It ends with the server; the client gets the result of its open run.
    Stop,
    /// Another host continues it.
    HandOver,
    /// Another owner has it already.
    Part,
    /// The client's new connection gets it.
    Give(Handover),
}

/// The end of the socket.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SocketEnd {
    /// It is dropped.
    Drop,
    /// The client's close frame is answered.
    Answer,
    /// A close frame with this code and reason is sent.
    Close(u16, String),
}

impl ConnectionEnd {
    /// Decides on session and socket. `moves_on`: another host continues the session when this server stops.
    pub(super) fn decide(self, moves_on: bool) -> (SessionFate, SocketEnd) {
        let close = |code, reason: &str| SocketEnd::Close(code, reason.into());
        let refused = |code: Code| close(code.close_code(), code.name());
        match self {
            ConnectionEnd::Greeted | ConnectionEnd::Lost => (SessionFate::Park, SocketEnd::Drop),
            ConnectionEnd::Closed => (SessionFate::Park, SocketEnd::Answer),
            ConnectionEnd::Violation(code, reason) => (SessionFate::Park, SocketEnd::Close(code, reason)),
            ConnectionEnd::Fatal(code) => (SessionFate::Park, refused(code)),
            ConnectionEnd::Bye => (SessionFate::Leave, close(CLOSE_NORMAL, "bye")),
            ConnectionEnd::Ended => (SessionFate::End, close(CLOSE_NORMAL, "session_over")),
            ConnectionEnd::Moved => (SessionFate::Part, close(CLOSE_RESTART, "session_moved")),
            ConnectionEnd::Replaced(to) => (SessionFate::Give(to), refused(Code::SessionTaken)),
            ConnectionEnd::Stopping if moves_on => {
                (SessionFate::HandOver, close(CLOSE_RESTART, "server_restart"))
            }
            ConnectionEnd::Stopping => (SessionFate::Stop, close(CLOSE_AWAY, "server_shutdown")),
        }
    }
}

impl SessionFate {
    /// Lets it come true. Returns the last message for the client, and the longest wait until it is sent.
    pub(super) async fn fulfil(self, session: Box<Session>, patience: Duration) -> Option<(Reply, Duration)> {
        match self {
            SessionFate::Park => session.park(),
            SessionFate::Leave => session.leave().await,
            SessionFate::End => drop(session.end(Reason::Stopped, None).await),
            SessionFate::Stop => {
                // Stored already: the client may have disconnected.
                let result = session.end(Reason::Stopped, Some("the server shut down")).await;
                return result.map(|result| (result, patience));
            }
            SessionFate::HandOver => session.hand_over().await,
            SessionFate::Part => session.part(),
            SessionFate::Give(to) => {
                session.give(to);
                let message = "a new connection has resumed this session with its resume_token";
                let refusal = Refusal::new(Code::SessionTaken, message).fatal();
                return Some((Reply::refused(None, &refusal), REPLACED_TIMEOUT));
            }
        }
        None
    }
}

impl SocketEnd {
    /// Ends a socket so.
    pub(super) async fn end(self, socket: WebSocket) {
        match self {
            SocketEnd::Drop => {}
            SocketEnd::Answer => answer_close(socket).await,
            SocketEnd::Close(code, reason) => close_handshake(socket, code, reason).await,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio::sync::oneshot;

    #[test]
    fn session_and_socket_follow_from_the_end_of_the_connection() {
        let (to, _claimant) = oneshot::channel();
        let frame = |code, reason: &str| SocketEnd::Close(code, reason.into());
        for (end, moves_on, fate, socket) in [
            (ConnectionEnd::Greeted, true, "Park", SocketEnd::Drop),
            (ConnectionEnd::Lost, true, "Park", SocketEnd::Drop),
            (ConnectionEnd::Closed, true, "Park", SocketEnd::Answer),
            (ConnectionEnd::Violation(1002, "mask".into()), true, "Park", frame(1002, "mask")),
            (ConnectionEnd::Fatal(Code::TooLarge), true, "Park", frame(4413, "too_large")),
            (ConnectionEnd::Bye, true, "Leave", frame(1000, "bye")),
            (ConnectionEnd::Ended, true, "End", frame(1000, "session_over")),
            (ConnectionEnd::Moved, true, "Part", frame(1012, "session_moved")),
            (ConnectionEnd::Replaced(to), true, "Give", frame(4409, "session_taken")),
            (ConnectionEnd::Stopping, true, "HandOver", frame(1012, "server_restart")),
            (ConnectionEnd::Stopping, false, "Stop", frame(1001, "server_shutdown")),
        ] {
            let case = format!("{end:?}");
            let (decided, closed) = end.decide(moves_on);
            assert!(format!("{decided:?}").starts_with(fate), "{case}: {decided:?}");
            assert_eq!(closed, socket, "{case}");
        }
    }
}
