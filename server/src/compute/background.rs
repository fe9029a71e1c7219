//! Work that nobody should feel: scenes that are built, runs that settle, runs that are simulated again. Each job
//! has a thread of its own below the priority of the ticks; only so many compute at once.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use thread_priority::{ThreadPriority, ThreadPriorityValue};
use tokio::sync::{Semaphore, oneshot};
use tokio::time::timeout;

/// Bytes of stack of a thread that computes worlds.
pub(crate) const STACK: usize = 8 << 20;

/// A job that takes longer leaves its place to others while it goes on: the longest that anybody waits for takes a few
/// seconds, so this one may never end.
const LONGEST: Duration = Duration::from_secs(10);

/// How much a job may take from others.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Level {
    /// Somebody waits for it: a tenth of what a tick gets when all cores are busy.
    Awaited,
    /// Nobody waits: next to nothing.
    Idle,
}

impl Level {
    fn priority(self) -> ThreadPriority {
        match self {
            // A quarter of the scale is niceness 10 on Linux.
            Level::Awaited => {
                ThreadPriorityValue::try_from(25).map_or(ThreadPriority::Min, ThreadPriority::Crossplatform)
            }
            Level::Idle => ThreadPriority::Min,
        }
    }
}

/// Runs jobs.
#[derive(Clone, Debug)]
pub(crate) struct Background {
    permits: Arc<Semaphore>,
    /// Afterwards a job's place is for others.
    longest: Duration,
}

/// Why a job gave nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum JobError {
    /// The thread could not be started.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// The job panicked.
    #[error("a job failed: {0}")]
    Panic(String),
}

impl Background {
    /// At most `most` jobs at once.
    pub(crate) fn new(most: usize) -> Self {
        Background { permits: Arc::new(Semaphore::new(most.max(1))), longest: LONGEST }
    }

    /// Does `job` when there is room, and returns what it gives. The job is done also when nobody waits any more.
    /// A job of many seconds leaves its place to others.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        level: Level,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, JobError> {
        // The semaphore is never closed.
        let permit = self.permits.clone().acquire_owned().await.ok();
        let permit = Arc::new(Mutex::new(permit));
        let leave = {
            let permit = permit.clone();
            move || drop(permit.lock().unwrap_or_else(PoisonError::into_inner).take())
        };
        let (done, mut result) = oneshot::channel();
        let leave_done = leave.clone();
        let body = move || {
            // A system that refuses is no reason not to do the work.
            if let Err(error) = level.priority().set_for_current() {
                tracing::debug!(?error, "thread priority not set");
            }
            let given = catch_unwind(AssertUnwindSafe(job));
            leave_done();
            // Whoever asked may be gone; then nobody wants to know.
            let _ = done.send(given.map_err(|panic| panic_text(panic.as_ref()).to_owned()));
        };
        std::thread::Builder::new().name("background".into()).stack_size(STACK).spawn(body)?;
        let waited = match timeout(self.longest, &mut result).await {
            Ok(given) => given,
            Err(_) => {
                leave();
                result.await
            }
        };
        match waited {
            Ok(given) => given.map_err(JobError::Panic),
            Err(_) => Err(JobError::Panic("the thread ended".into())),
        }
    }
}

/// What a panic said.
pub(crate) fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_panic_is_told_and_frees_the_place() {
        let background = Background::new(1);
        let error =
            background.run(Level::Awaited, || -> u8 { panic!("toy panic") }).await.expect_err("panics");
        assert!(error.to_string().contains("toy panic"), "{error}");
        assert_eq!(background.run(Level::Idle, || 7).await.expect("runs"), 7);
    }

    #[tokio::test]
    async fn a_job_that_never_ends_leaves_its_place_to_others() {
        let background = Background { longest: Duration::from_millis(1), ..Background::new(1) };
        let (end, stuck) = std::sync::mpsc::channel::<()>();
        let endless = {
            let background = background.clone();
            tokio::spawn(async move { background.run(Level::Idle, move || stuck.recv().is_err()).await })
        };
        // Until it runs.
        while background.permits.available_permits() > 0 {
            tokio::task::yield_now().await;
        }
        assert_eq!(background.run(Level::Awaited, || 7).await.expect("runs"), 7);
        drop(end);
        assert!(endless.await.expect("no panic").expect("it ends in the end"));
    }
}
