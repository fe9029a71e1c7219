//! Connections of the server, below what they are for: options, tokens, sockets, limits, problems.

pub mod auth;
pub mod config;
pub mod process;
pub mod transport;
