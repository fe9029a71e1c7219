//! Connections: which are accepted, how much each may send, and the path with low latency.

mod body;
mod caller;
mod close_handshake;
mod connections;
mod frame_error;
pub(crate) mod guard;
mod guard_layer;
mod inbound_limits;
pub(crate) mod low_latency;
pub(crate) mod problem;
mod quota;
mod serve;
mod socket_limits;
pub(crate) mod trusted_proxies;
mod upgrade;

pub(crate) use body::Received;
pub(crate) use caller::Caller;
pub(crate) use close_handshake::{answer_close, close_handshake};
pub(crate) use connections::ConnectionPermit;
pub(crate) use frame_error::FrameError;
pub(crate) use guard_layer::guard;
pub(crate) use inbound_limits::InboundLimits;
pub(crate) use quota::{Quota, Quotas};
pub(crate) use serve::serve;
pub(crate) use upgrade::{UpgradeRefused, upgrade};
