//! Which program this is.

use palmares_protocol::reply::ServerInfo;

/// Commit it was built from.
pub(crate) const BUILD_HASH: &str = env!("PALMARES_BUILD_HASH");

/// This program, as clients are told.
pub fn own() -> ServerInfo {
    ServerInfo { version: env!("CARGO_PKG_VERSION").into(), build_hash: BUILD_HASH.into() }
}
