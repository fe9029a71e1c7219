//! What comes in and goes out over sockets: who is let in, how much is taken of whom, and the control connections.

mod body;
mod caller;
mod connection;
mod connections;
mod control;
mod counts;
mod doors;
mod entrance;
mod farewell;
pub(crate) mod guard;
mod guard_layer;
pub(crate) mod low_latency;
mod rate;
mod serve;

pub(crate) use body::Received;
pub(crate) use caller::Caller;
pub(crate) use control::control;
pub(crate) use entrance::Entrance;
pub(crate) use farewell::farewell;
pub(crate) use guard_layer::guard;
pub(crate) use serve::serve;
