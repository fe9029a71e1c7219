//! The messages of protocol v1, JSON over WebSocket text frames.
//!
//! A client sends requests, each with an `op` and an `id`; the server answers each with exactly one reply,
//! in order, that carries the same `id` and an `op` of its own: `welcome`, `obs`, `result`, `time`, `error`.
//! The reply to `bye` is the close frame with code 1000. A request that fails changes nothing.
//! The server sends one kind of message unasked, without `id`: `warning`; and, when it closes a run because
//! it shuts down, that run's `result`.

mod action;
pub(crate) mod code;
pub(crate) mod reply;
pub(crate) mod request;
pub(crate) mod specs;

pub(crate) use code::{Code, Refusal};
pub(crate) use reply::Reply;
pub(crate) use request::{Hello, Request, Reset, Step};

/// WebSocket subprotocol of this encoding.
pub(crate) const SUBPROTOCOL_JSON: &str = "palmares.v1.json";

/// Largest whole number that every JSON reader holds exactly: 2⁵³ − 1.
pub(crate) const MAX_SAFE_INTEGER: u64 = (1 << 53) - 1;
