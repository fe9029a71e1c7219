//! The version of the program.

use palmares_protocol::reply::ServerInfo;

/// The version and commit of this program, as in a server's `welcome`.
pub fn version() -> ServerInfo {
    ServerInfo { version: env!("CARGO_PKG_VERSION").into(), build_hash: env!("PALMARES_BUILD_HASH").into() }
}
