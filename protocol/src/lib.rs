//! The messages of protocol v1, over WebSocket frames: JSON as text or MessagePack as binary.
//!
//! A client sends requests, each with an `op` and an `id`. The server sends exactly one reply to each, in order, with
//! the same `id` and an `op` of its own: `welcome`, `obs`, `ack`, `result`, `time`, `error`. The reply to `bye` is
//! the close frame with code 1000. A request that fails changes nothing. Some messages answer no request and have no
//! `id`: `obs` in a realtime run, `warning`, and the `result` of a run that the server closes because it shuts down.
//!
//! Python, TypeScript and docs/schema have their types from these: `cargo xtask generate` writes them.

mod action;
pub mod code;
pub mod encoding;
pub mod obs;
pub mod parse;
pub mod reply;
pub mod request;
pub mod specs;
pub mod text;
mod utc;

pub use code::{Code, Refusal};
pub use encoding::Encoding;
pub use parse::{MAX_SAFE_INTEGER, Parsed};
pub use reply::Reply;
pub use request::{Act, Hello, Mode, Perturb, Request, Reset, Step};
pub use utc::{unix_ms, utc};
