//! The program's version.

use palmares_protocol::reply::ServerInfo;
use std::sync::OnceLock;

static OWN: OnceLock<ServerInfo> = OnceLock::new();

/// Sets version and commit of the program that runs this server. Later calls change nothing.
///
/// The program passes them, so that a new commit compiles the program again and not this crate.
pub fn set(own: ServerInfo) {
    let _ = OWN.set(own);
}

/// The program's version, for clients.
pub fn own() -> ServerInfo {
    OWN.get().cloned().unwrap_or_else(|| ServerInfo {
        version: env!("CARGO_PKG_VERSION").into(),
        build_hash: "unknown".into(),
    })
}
