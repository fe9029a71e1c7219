//! The computing resources of the server.

use super::admission::{Admission, Admitted, NoPlace, RETRY_S, admit};
use super::background::Background;
use super::open_worlds::WorldRequest;
use super::pacer::Pacer;
use super::queue::WAIT;
use super::scheduler::Scheduler;
use palmares_protocol::{Code, Refusal};
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::Semaphore;

/// The computing resources of the server.
#[derive(Debug)]
pub struct Compute {
    /// Permits for ticks.
    pub scheduler: Scheduler,
    /// Jobs in the background.
    pub background: Background,
    /// Limits equilibria for clients without a run to one at a time.
    pub statics: Arc<Semaphore>,
    /// Threads of realtime worlds.
    pub pacer: Pacer,
    /// The open worlds.
    pub admission: Admission,
    max_worlds: usize,
}

impl Compute {
    /// Resources with this number of cores and at most this number of open worlds.
    pub fn new(cores: usize, max_worlds: usize) -> Self {
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
    pub fn max_worlds(&self) -> usize {
        self.max_worlds
    }

    /// Admits the world of a run that another host has begun: it has a place in any case.
    pub fn admit_continued(&self, request: WorldRequest<'_>) -> Admitted {
        self.admission.force(request, Instant::now())
    }

    /// Admits another world.
    ///
    /// # Errors
    /// The maximum is reached, it would slow the others, or other sessions have waited longer.
    pub fn admit(&self, request: WorldRequest<'_>) -> Result<Admitted, Refusal> {
        let now = Instant::now();
        let load = self.scheduler.load().report(now);
        let (max, cores) = (self.max_worlds, self.scheduler.cores());
        let may = |open| admit(open, max, cores, &load, request.mode, request.official);
        self.admission.take(request, now, may).map_err(|NoPlace { error, ahead }| {
            tracing::info!(%error, session = request.session_id, ahead, ?load, "no place for a world");
            let wait_s = WAIT.as_secs();
            let message = format!(
                "{error}. {} before this one; its place in the queue is kept and its clock is stopped for {wait_s} s: \
                 ask again within this time",
                if ahead == 1 { "1 session waits".to_owned() } else { format!("{ahead} sessions wait") }
            );
            Refusal::new(Code::Capacity, message).retry_after(RETRY_S)
        })
    }
}
