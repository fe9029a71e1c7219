//! The program's version.

use palmares_protocol::reply::ServerInfo;

/// Commit of the build.
pub(crate) const BUILD_HASH: &str = env!("PALMARES_BUILD_HASH");

/// The program's version, for clients.
pub fn own() -> ServerInfo {
    ServerInfo { version: env!("CARGO_PKG_VERSION").into(), build_hash: BUILD_HASH.into() }
}
