//! The server: network, sessions, storage. Its options are in [`ServeOptions`].

mod app;
mod archive;
mod auth;
mod backup;
mod blocking;
mod clock;
mod competition;
mod compute;
mod config;
mod control;
mod disk_space;
mod documents;
mod fleet;
mod hands;
mod http;
mod lifecycle;
mod logging;
mod metrics;
mod names;
mod new_keys;
mod objects;
mod private_files;
mod problem;
#[cfg(test)]
mod random_schedules;
mod readiness;
mod restore;
mod rules;
mod schedule;
pub mod schema;
mod session;
mod state;
mod store;
mod stored_path;
mod transport;
pub mod untrusted;
mod version;
mod watch;
mod world;

pub use app::serve;
pub use config::{ServeOptions, hand_limits};
pub use new_keys::{NewKeys, new_keys};
pub use restore::restore;
pub use store::runs_in;
pub use version::own as version;
