//! The server: network, sessions, storage. What it can be told is in [`ServeOptions`].

mod api;
mod archive;
mod auth;
mod backup;
mod config;
mod hands;
mod metrics;
mod names;
mod net;
mod restore;
mod rules;
pub mod schema;
mod serve;
mod session;
mod store;
mod telemetry;
mod version;
mod watch;
mod ws;

pub use config::{ServeOptions, hand_limits};
pub use restore::restore;
pub use serve::serve;
pub use store::utc;

use palmares_protocol as protocol;
use palmares_tasks::inspect;
