//! Connections: which are accepted, how much each may send, and the path with low latency.

mod body;
mod caller;
mod close_handshake;
mod connections;
mod frame_error;
pub mod guard;
mod guard_layer;
mod inbound_limits;
pub mod low_latency;
pub mod problem;
mod quota;
mod serve;
mod socket_limits;
pub mod trusted_proxies;
mod upgrade;

pub use body::Received;
pub use caller::Caller;
pub use close_handshake::{answer_close, close_handshake};
pub use connections::ConnectionPermit;
pub use frame_error::FrameError;
pub use guard_layer::guard;
pub use inbound_limits::InboundLimits;
pub use quota::{Quota, Quotas};
pub use serve::serve;
pub use upgrade::{UpgradeRefused, upgrade};
