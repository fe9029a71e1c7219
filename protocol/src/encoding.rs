//! Writes messages as frames: JSON in text frames, MessagePack in binary frames, with the same fields.
//! [`crate::parse`] reads them.

use crate::reply::Reply;
use serde::Serialize;

/// The encoding of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Text frames.
    Json,
    /// Binary frames; structs are maps with the names of their fields.
    MsgPack,
}

/// The payload of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Payload {
    /// In a text frame.
    Text(String),
    /// In a binary frame.
    Binary(Vec<u8>),
}

/// Reason why a message cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// As JSON.
    #[error("as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// As JSON: it is not UTF-8.
    #[error("as JSON: not UTF-8")]
    Utf8(#[from] std::string::FromUtf8Error),
    /// As MessagePack.
    #[error("as MessagePack: {0}")]
    MsgPack(#[from] rmp_serde::encode::Error),
}

impl Encoding {
    /// All encodings; the server takes the first one that a client offers.
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

    /// Writes a message. `capacity`: its probable size, bytes.
    ///
    /// # Errors
    /// The message has a value that the encoding lacks.
    pub fn write(self, reply: &Reply, capacity: usize) -> Result<Payload, WriteError> {
        let mut bytes = Vec::with_capacity(capacity);
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
}
