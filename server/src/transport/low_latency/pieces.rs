//! Which pieces of the low-latency path are used.

/// A connection looks for its next request before it sleeps.
pub(super) const BUSY_POLL: bool = true;
/// What it looks at is the socket itself, not what the runtime was told of it.
pub(super) const DIRECT_READ: bool = true;
/// Clients on the same machine may come through a Unix socket.
pub(super) const LOCAL_SOCKET: bool = true;
