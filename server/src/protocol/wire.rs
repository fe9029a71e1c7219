//! Messages as frames: JSON as text, MessagePack as binary, with the same fields.

use super::reply::Reply;
use super::request::{Parsed, parse_json, parse_msgpack};
use super::{Code, Refusal};
use axum::extract::ws::Message;

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

    /// A message as a frame.
    pub(crate) fn write(self, reply: &Reply) -> Result<Message, WriteError> {
        Ok(match self {
            Encoding::Json => Message::Text(serde_json::to_string(reply)?.into()),
            Encoding::MsgPack => Message::Binary(rmp_serde::to_vec_named(reply)?.into()),
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
