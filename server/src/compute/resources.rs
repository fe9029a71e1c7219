//! What a server computes with.

use super::admission::{Admission, Admitted, RETRY_S, admit};
use super::background::Background;
use super::pacer::Pacer;
use super::scheduler::Scheduler;
use palmares_protocol::{Code, Mode, Refusal};
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::Semaphore;

/// Its cores, and who may use them.
#[derive(Debug)]
pub(crate) struct Compute {
    /// Who may compute when.
    pub(crate) scheduler: Scheduler,
    /// Where scenes are built and runs settle.
    pub(crate) background: Background,
    /// One hand at a time is looked at for somebody who plays nothing.
    pub(crate) statics: Arc<Semaphore>,
    /// Keeps realtime worlds on the clock.
    pub(crate) pacer: Pacer,
    /// Which worlds are open.
    pub(crate) admission: Admission,
    max_worlds: usize,
}

impl Compute {
    /// For so many cores, and at most so many open worlds.
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

    /// Admits another world.
    ///
    /// # Errors
    /// There are enough, or it would slow the others.
    pub(crate) fn admit(&self, mode: Mode, official: bool) -> Result<Admitted, Refusal> {
        let load = self.scheduler.load().report(Instant::now());
        let (most, cores) = (self.max_worlds, self.scheduler.cores());
        let may = |open| admit(open, most, cores, &load, mode, official);
        self.admission.take(mode, official, may).map_err(|full| {
            tracing::info!(%full, ?load, "no place for a world");
            Refusal::new(Code::Capacity, full.to_string()).retry_after(RETRY_S)
        })
    }
}
