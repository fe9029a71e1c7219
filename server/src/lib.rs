//! The server: network, sessions, storage. Its options are in [`ServeOptions`].

mod app;
mod archive;
mod backup;
mod competition;
mod control;
mod fleet;
mod http;
mod schedule;
pub mod schema;
mod session;
pub mod untrusted;
mod watch;

pub use app::serve;
pub use backup::restore::restore;
pub use competition::new_keys::{NewKeys, new_keys};
pub use palmares_net::config::{ServeOptions, hand_limits};
pub use palmares_store::runs_in;
