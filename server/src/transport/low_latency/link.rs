//! What a connection has of the low-latency path.

use super::attention::Attention;
use super::busy_poll::{Awake, BusyPoll};
use std::sync::Arc;

/// What a connection has of it; by default nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Link {
    pub(super) attention: Attention,
    /// Counts who stays awake.
    pub(super) awake: Option<Arc<Awake>>,
}

impl Link {
    /// How the connection waits for requests, on a machine with so many cores.
    pub(crate) fn busy_poll(self, cores: usize) -> BusyPoll {
        BusyPoll::new(self.attention, self.awake, cores)
    }
}
