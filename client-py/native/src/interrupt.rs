//! Long work that Ctrl-C ends, and that reports its progress.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Interval at which a long call checks whether it is to end.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// A Python function that is called with the progress.
pub(crate) type ProgressReport<'py> = Option<Bound<'py, PyAny>>;

/// Reports the progress if there is a function for it.
pub(crate) fn report_progress(report: &ProgressReport<'_>, done: u64) -> PyResult<()> {
    report.as_ref().map_or(Ok(()), |report| report.call1((done,)).map(|_| ()))
}

/// Does `work` on a thread of its own, without the interpreter's lock. If a signal raises an exception
/// meanwhile, this is raised at once, and the result of the work is dropped.
///
/// # Errors
/// The exception of the signal handler; the work panicked.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    interruptible_with_progress(py, &None, |_| work())
}

/// Like `interruptible`, and calls `report` repeatedly with the count of `work`.
///
/// # Errors
/// The exception of the signal handler or of `report`; the work panicked.
pub(crate) fn interruptible_with_progress<T: Send + 'static>(
    py: Python<'_>,
    report: &ProgressReport<'_>,
    work: impl FnOnce(&AtomicU64) -> T + Send + 'static,
) -> PyResult<T> {
    let counted = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&counted);
    let (done, result) = channel();
    let thread = std::thread::Builder::new().name("palmares".into()).spawn(move || {
        // After an interrupted call there is no receiver.
        let _ = done.send(work(&counter));
    });
    thread.map_err(|error| PyRuntimeError::new_err(format!("no thread: {error}")))?;
    // A receiver is for one thread at a time; it is lent to this one for as long as the lock is not held.
    let mut result = result;
    loop {
        let waited = py.detach(|| {
            let lent = &mut result;
            lent.recv_timeout(LOOK)
        });
        match waited {
            Ok(value) => return Ok(value),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals()?;
                report_progress(report, counted.load(Ordering::Relaxed))?;
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the simulation failed; see what it printed"));
            }
        }
    }
}
