//! The computing resources of the server.

use super::admission::{Admission, Admitted, RETRY_S, admit};
use super::background::Background;
use super::pacer::Pacer;
use super::scheduler::Scheduler;
use palmares_protocol::{Code, Mode, Refusal};
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::Semaphore;

/// The computing resources of the server.
#[derive(Debug)]
pub(crate) struct Compute {
    /// Permits for ticks.
    pub(crate) scheduler: Scheduler,
    /// Jobs in the background.
    pub(crate) background: Background,
    /// Limits equilibria for clients without a run to one at a time.
    pub(crate) statics: Arc<Semaphore>,
    /// Threads of realtime worlds.
    pub(crate) pacer: Pacer,
    /// The open worlds.
    pub(crate) admission: Admission,
    max_worlds: usize,
}

impl Compute {
    /// Resources with this number of cores and at most this number of open worlds.
    pub(crate) fn new(cores: usize, max_worlds: usize) -> Self {
        Compute {
            scheduler: Scheduler::new(cores),
            background: Background::new(cores),
            statics: Arc::new(Semaphore::new(1)),
            pacer: Pacer::start(cores),
            admission: Admission::default(),
            max_worlds,
        }
    }

    /// Number of worlds that can be open.
    pub(crate) fn max_worlds(&self) -> usize {
        self.max_worlds
    }

    /// Admits another world.
    ///
    /// # Errors
    /// The maximum is reached, or it would slow the others.
    pub(crate) fn admit(&self, mode: Mode, official: bool) -> Result<Admitted, Refusal> {
        let load = self.scheduler.load().report(Instant::now());
        let (max, cores) = (self.max_worlds, self.scheduler.cores());
        let may = |open| admit(open, max, cores, &load, mode, official);
        self.admission.take(mode, official, may).map_err(|error| {
            tracing::info!(%error, ?load, "no place for a world");
            Refusal::new(Code::Capacity, error.to_string()).retry_after(RETRY_S)
        })
    }
}
