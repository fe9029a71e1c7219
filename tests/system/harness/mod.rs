//! Parts of every test: a server of its own, a client that sends raw frames, plain HTTP.

mod client;
#[path = "../../../models/src/tests/exported_hand.rs"]
pub(crate) mod exported_hand;
pub(crate) mod fleet;
mod http;
pub(crate) mod kubelet;
mod official;
mod postgres;
pub(crate) mod raw;
mod server;
mod small_disk;

pub(crate) use client::{Client, assert_error, handshake, handshake_to};
pub(crate) use http::{Response, exchange, get, get_bytes, request, send};
pub(crate) use official::{Official, RULES, bearer, reset as official_reset};
pub(crate) use postgres::{Postgres, postgres_database};
pub(crate) use server::{Server, program};
pub(crate) use small_disk::SmallDisk;

use serde_json::{Value, json};

/// A run as most tests open it.
pub(crate) fn reset() -> Value {
    json!({"op": "reset", "task": "balls", "hand": "softhand", "seed": 7})
}

/// A step that holds still.
pub(crate) fn step(tick: u64) -> Value {
    json!({"op": "step", "tick": tick, "action": {}})
}
