//! What a connection has of the low-latency path.

use super::attention::Attention;
use super::busy_poll::{Awake, BusyPoll};
use axum::http::{HeaderMap, HeaderValue};
use std::sync::Arc;

/// Header of the answer to a handshake: the name of the local socket.
const LOCAL_HEADER: &str = "palmares-local";

/// What a connection has of it; by default nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Link {
    pub(super) attention: Attention,
    /// The socket that this caller may come through instead, on the same machine.
    pub(super) local: Option<Arc<str>>,
    /// Counts who stays awake.
    pub(super) awake: Option<Arc<Awake>>,
}

impl Link {
    /// Tells a caller on the same machine of the local socket, in the answer to its handshake.
    pub(crate) fn offer(&self, headers: &mut HeaderMap) {
        if let Some(name) = self.local.as_ref().and_then(|name| HeaderValue::from_str(name).ok()) {
            headers.insert(LOCAL_HEADER, name);
        }
    }

    /// How the connection waits for requests, on a machine with so many cores.
    pub(crate) fn busy_poll(self, cores: usize) -> BusyPoll {
        BusyPoll::new(self.attention, self.awake, cores)
    }
}
