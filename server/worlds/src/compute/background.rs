//! Jobs in the background: building scenes, scoring runs, verifying replays, checking hands. Each job has a thread of its own, below
//! the priority of the ticks. The number of jobs at once is limited.

use parking_lot::Mutex;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;
use thread_priority::{ThreadPriority, ThreadPriorityValue};
use tokio::sync::{Semaphore, oneshot};
use tokio::time::timeout;

/// Stack of a thread that computes worlds, bytes.
pub const STACK_BYTES: usize = 8 << 20;

/// A job that takes longer releases its permit and runs on. Normal jobs take a few seconds at most, so this one may never end.
const MAX_HOLD: Duration = Duration::from_secs(10);

/// The priority of a job.
#[derive(Clone, Copy, Debug)]
pub enum JobPriority {
    /// A client waits: about a tenth of the weight of a tick when all cores are busy.
    Awaited,
    /// No client waits: the lowest priority.
    Idle,
}

impl JobPriority {
    fn thread_priority(self) -> ThreadPriority {
        match self {
            // 25 of 100 is niceness 10 on Linux.
            JobPriority::Awaited => {
                ThreadPriorityValue::try_from(25).map_or(ThreadPriority::Min, ThreadPriority::Crossplatform)
            }
            JobPriority::Idle => ThreadPriority::Min,
        }
    }
}

/// Runs jobs.
#[derive(Clone, Debug)]
pub struct Background {
    permits: Arc<Semaphore>,
    /// Afterwards a job's permit is released.
    max_hold: Duration,
}

/// Reason why a job has no result.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The thread could not be started.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// The job panicked.
    #[error("a job failed: {0}")]
    Panic(String),
}

impl Background {
    /// At most `max_jobs` at once.
    pub fn new(max_jobs: usize) -> Self {
        Background { permits: Arc::new(Semaphore::new(max_jobs.max(1))), max_hold: MAX_HOLD }
    }

    /// Runs `job` when a permit is free, and returns its result. The job runs to its end even if the caller stops waiting.
    pub async fn run<T: Send + 'static>(
        &self,
        priority: JobPriority,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, JobError> {
        // The semaphore is never closed.
        let permit = self.permits.clone().acquire_owned().await.ok();
        let permit = Arc::new(Mutex::new(permit));
        let release = {
            let permit = permit.clone();
            move || drop(permit.lock().take())
        };
        let (done, mut result) = oneshot::channel();
        let release_when_done = release.clone();
        let body = move || {
            // Without the priority the job runs all the same.
            if let Err(error) = priority.thread_priority().set_for_current() {
                tracing::debug!(?error, "thread priority not set");
            }
            let given = catch_unwind(AssertUnwindSafe(job));
            release_when_done();
            // An error means that the caller has stopped waiting.
            let _ = done.send(given.map_err(|panic| panic_text(panic.as_ref()).to_owned()));
        };
        std::thread::Builder::new().name("background".into()).stack_size(STACK_BYTES).spawn(body)?;
        let waited = match timeout(self.max_hold, &mut result).await {
            Ok(given) => given,
            Err(_) => {
                release();
                result.await
            }
        };
        match waited {
            Ok(given) => given.map_err(JobError::Panic),
            Err(_) => Err(JobError::Panic("the thread ended".into())),
        }
    }
}

/// The message of a panic.
pub fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_panic_is_reported_and_releases_the_permit() {
        let background = Background::new(1);
        let error =
            background.run(JobPriority::Awaited, || -> u8 { panic!("toy panic") }).await.expect_err("panics");
        assert!(error.to_string().contains("toy panic"), "{error}");
        assert_eq!(background.run(JobPriority::Idle, || 7).await.expect("runs"), 7);
    }

    #[tokio::test]
    async fn a_job_that_never_ends_releases_its_permit() {
        let background = Background { max_hold: Duration::from_millis(1), ..Background::new(1) };
        let (end, stuck) = std::sync::mpsc::channel::<()>();
        let endless = {
            let background = background.clone();
            tokio::spawn(
                async move { background.run(JobPriority::Idle, move || stuck.recv().is_err()).await },
            )
        };
        // Until it runs.
        while background.permits.available_permits() > 0 {
            tokio::task::yield_now().await;
        }
        assert_eq!(background.run(JobPriority::Awaited, || 7).await.expect("runs"), 7);
        drop(end);
        assert!(endless.await.expect("no panic").expect("it ends in the end"));
    }
}
