//! Messages as frames: JSON as text, MessagePack as binary, with the same fields.

use super::reply::Reply;
use super::request::{Parsed, parse_json, parse_msgpack};
use super::{Code, Refusal};
use axum::extract::ws::{Message, Utf8Bytes};
use serde::Serialize;

/// How messages are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Text frames.
    Json,
    /// Binary frames; structs are maps with the names of their fields.
    MsgPack,
}

/// Why a message could not be written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WriteError {
    /// As JSON.
    #[error("as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// As JSON, with what is no text.
    #[error("as JSON: not UTF-8")]
    Utf8,
    /// As MessagePack.
    #[error("as MessagePack: {0}")]
    MsgPack(#[from] rmp_serde::encode::Error),
}

impl Encoding {
    /// All of them; of those that a client offers the first one here is taken.
    pub(crate) const ALL: [Encoding; 2] = [Encoding::Json, Encoding::MsgPack];

    /// The WebSocket subprotocol.
    pub(crate) fn subprotocol(self) -> &'static str {
        match self {
            Encoding::Json => "palmares.v1.json",
            Encoding::MsgPack => "palmares.v1.msgpack",
        }
    }

    /// The encoding of a subprotocol.
    pub(crate) fn of(subprotocol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|encoding| encoding.subprotocol() == subprotocol)
    }

    /// A message as a frame. `room`: as long as it will probably be, bytes.
    pub(crate) fn write(self, reply: &Reply, room: usize) -> Result<Message, WriteError> {
        let mut bytes = Vec::with_capacity(room);
        Ok(match self {
            Encoding::Json => {
                serde_json::to_writer(&mut bytes, reply)?;
                Message::Text(Utf8Bytes::try_from(bytes).map_err(|_| WriteError::Utf8)?)
            }
            Encoding::MsgPack => {
                reply.serialize(&mut rmp_serde::Serializer::new(&mut bytes).with_struct_map())?;
                Message::Binary(bytes.into())
            }
        })
    }

    /// A frame as a request. None for a frame that carries no message.
    pub(crate) fn read(self, frame: &Message) -> Option<Parsed> {
        let wrong = |kind: &str| {
            let message = format!("{} has {kind} frames only", self.subprotocol());
            Some(Parsed { id: None, request: Err(Refusal::new(Code::BadJson, message)) })
        };
        match (self, frame) {
            (Encoding::Json, Message::Text(text)) => Some(parse_json(text)),
            (Encoding::MsgPack, Message::Binary(bytes)) => Some(parse_msgpack(bytes)),
            (Encoding::Json, Message::Binary(_)) => wrong("text"),
            (Encoding::MsgPack, Message::Text(_)) => wrong("binary"),
            (_, Message::Ping(_) | Message::Pong(_) | Message::Close(_)) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::request::Request;

    #[test]
    fn a_frame_of_the_other_kind_is_refused() {
        let text = || Message::Text(r#"{"op":"time","id":1}"#.into());
        let packed = rmp_serde::to_vec_named(&serde_json::json!({"op": "time", "id": 1})).expect("packs");
        let binary = || Message::Binary(packed.clone().into());
        for (encoding, good, bad) in
            [(Encoding::Json, text(), binary()), (Encoding::MsgPack, binary(), text())]
        {
            let parsed = encoding.read(&good).expect("a message");
            assert_eq!(parsed.id, Some(1));
            assert!(matches!(parsed.request, Ok(Request::Time(_))));
            let refusal = encoding.read(&bad).expect("a message").request.expect_err("refused");
            assert_eq!(refusal.code, Code::BadJson);
            assert!(refusal.message.contains("frames only"), "{}", refusal.message);
        }
    }

    #[test]
    fn what_is_not_messagepack_is_bad_json() {
        let deep = [vec![0x91; 2000], vec![0xc0]].concat();
        let more = [packed(), vec![0]].concat();
        for bytes in [&[][..], &[0xc1], &[0x82, 0xa2], &[0xdf, 0xff, 0xff, 0xff, 0xff], &deep, &more] {
            let parsed = Encoding::MsgPack.read(&Message::Binary(bytes.to_vec().into())).expect("a message");
            assert_eq!(parsed.request.expect_err("refused").code, Code::BadJson, "{bytes:?}");
        }
    }

    fn packed() -> Vec<u8> {
        rmp_serde::to_vec_named(&serde_json::json!({"op": "time", "id": 1})).expect("packs")
    }
}
