//! What comes in and goes out over sockets: who is let in, how much is taken of whom, and the control connections.

mod body;
mod caller;
mod connections;
mod counts;
mod farewell;
pub(crate) mod guard;
mod guard_layer;
mod inbound_limits;
pub(crate) mod low_latency;
mod serve;
mod socket_limits;

pub(crate) use body::Received;
pub(crate) use caller::Caller;
pub(crate) use connections::ConnectionPermit;
pub(crate) use farewell::farewell;
pub(crate) use guard_layer::guard;
pub(crate) use inbound_limits::InboundLimits;
pub(crate) use serve::serve;
