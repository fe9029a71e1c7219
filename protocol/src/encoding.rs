//! Messages as frames: JSON as text, MessagePack as binary, with the same fields.

use crate::code::{Code, Refusal};
use crate::parse::{Parsed, parse_json, parse_msgpack};
use crate::reply::Reply;
use serde::Serialize;

/// How messages are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Text frames.
    Json,
    /// Binary frames; structs are maps with the names of their fields.
    MsgPack,
}

/// What a frame carries.
#[derive(Clone, Debug, PartialEq)]
pub enum Payload {
    /// In a text frame.
    Text(String),
    /// In a binary frame.
    Binary(Vec<u8>),
}

/// Why a message could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// As JSON.
    #[error("as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// As JSON, with what is no text.
    #[error("as JSON: not UTF-8")]
    Utf8(#[from] std::string::FromUtf8Error),
    /// As MessagePack.
    #[error("as MessagePack: {0}")]
    MsgPack(#[from] rmp_serde::encode::Error),
}

impl Encoding {
    /// All of them; of those that a client offers the first one here is taken.
    pub const ALL: [Encoding; 2] = [Encoding::Json, Encoding::MsgPack];

    /// The WebSocket subprotocol.
    pub fn subprotocol(self) -> &'static str {
        match self {
            Encoding::Json => "palmares.v1.json",
            Encoding::MsgPack => "palmares.v1.msgpack",
        }
    }

    /// The encoding of a subprotocol.
    pub fn of(subprotocol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|encoding| encoding.subprotocol() == subprotocol)
    }

    /// A message. `room`: as long as it will probably be, bytes.
    ///
    /// # Errors
    /// It holds what the encoding has no word for.
    pub fn write(self, reply: &Reply, room: usize) -> Result<Payload, WriteError> {
        let mut bytes = Vec::with_capacity(room);
        Ok(match self {
            Encoding::Json => {
                serde_json::to_writer(&mut bytes, reply)?;
                Payload::Text(String::from_utf8(bytes)?)
            }
            Encoding::MsgPack => {
                reply.serialize(&mut rmp_serde::Serializer::new(&mut bytes).with_struct_map())?;
                Payload::Binary(bytes)
            }
        })
    }

    /// What came in a text frame.
    pub fn read_text(self, text: &str) -> Parsed {
        match self {
            Encoding::Json => parse_json(text),
            Encoding::MsgPack => self.has_only("binary"),
        }
    }

    /// What came in a binary frame.
    pub fn read_binary(self, bytes: &[u8]) -> Parsed {
        match self {
            Encoding::Json => self.has_only("text"),
            Encoding::MsgPack => parse_msgpack(bytes),
        }
    }

    fn has_only(self, kind: &str) -> Parsed {
        let message = format!("{} has {kind} frames only", self.subprotocol());
        Parsed { id: None, request: Err(Refusal::new(Code::BadJson, message)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::Request;

    #[test]
    fn a_frame_of_the_other_kind_is_refused() {
        let text = |encoding: Encoding| encoding.read_text(r#"{"op":"time","id":1}"#);
        let binary = |encoding: Encoding| encoding.read_binary(&packed());
        for (good, bad) in [
            (text(Encoding::Json), binary(Encoding::Json)),
            (binary(Encoding::MsgPack), text(Encoding::MsgPack)),
        ] {
            assert_eq!(good.id, Some(1));
            assert!(matches!(good.request, Ok(Request::Time(_))));
            let refusal = bad.request.expect_err("refused");
            assert_eq!(refusal.code, Code::BadJson);
            assert!(refusal.message.contains("frames only"), "{}", refusal.message);
        }
    }

    #[test]
    fn what_is_not_messagepack_is_bad_json() {
        let deep = [vec![0x91; 2000], vec![0xc0]].concat();
        let more = [packed(), vec![0]].concat();
        for bytes in [&[][..], &[0xc1], &[0x82, 0xa2], &[0xdf, 0xff, 0xff, 0xff, 0xff], &deep, &more] {
            let parsed = Encoding::MsgPack.read_binary(bytes);
            assert_eq!(parsed.request.expect_err("refused").code, Code::BadJson, "{bytes:?}");
        }
    }

    fn packed() -> Vec<u8> {
        rmp_serde::to_vec_named(&serde_json::json!({"op": "time", "id": 1})).expect("packs")
    }
}
