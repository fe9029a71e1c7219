//! Messages as WebSocket frames.

use axum::extract::ws::Message;
use palmares_protocol::encoding::{Encoding, Payload, WriteError};
use palmares_protocol::parse::Parsed;
use palmares_protocol::reply::Reply;

/// A message as a frame. `room`: as long as it will probably be, bytes.
pub(crate) fn write(encoding: Encoding, reply: &Reply, room: usize) -> Result<Message, WriteError> {
    Ok(match encoding.write(reply, room)? {
        Payload::Text(text) => Message::Text(text.into()),
        Payload::Binary(bytes) => Message::Binary(bytes.into()),
    })
}

/// A frame as a request. None for a frame that carries no message.
pub(crate) fn read(encoding: Encoding, frame: &Message) -> Option<Parsed> {
    match frame {
        Message::Text(text) => Some(encoding.read_text(text)),
        Message::Binary(bytes) => Some(encoding.read_binary(bytes)),
        Message::Ping(_) | Message::Pong(_) | Message::Close(_) => None,
    }
}
