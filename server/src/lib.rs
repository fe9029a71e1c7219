//! The server: network, sessions, storage. Its options are in [`ServeOptions`].

mod app;
mod archive;
mod auth;
mod backup;
mod clock;
mod competition;
mod compute;
mod config;
mod control;
mod documents;
mod files;
mod fleet;
mod http;
mod metrics;
mod names;
mod process;
#[cfg(test)]
mod random_schedules;
mod schedule;
pub mod schema;
mod session;
mod store;
mod transport;
pub mod untrusted;
mod watch;
mod world;

pub use app::serve;
pub use backup::restore::restore;
pub use competition::new_keys::{NewKeys, new_keys};
pub use config::{ServeOptions, hand_limits};
pub use process::version::own as version;
pub use store::runs_in;
