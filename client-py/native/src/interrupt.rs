//! Long work that Ctrl-C ends.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often a long call looks whether it is to end.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// Does `work` on a thread of its own, without the interpreter's lock. When a signal raises an exception meanwhile, that is
/// raised at once, and what the work gives is dropped.
///
/// # Errors
/// The exception of the signal handler; the work panicked.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (done, result) = channel();
    let thread = std::thread::Builder::new().name("palmares".into()).spawn(move || {
        // Nobody waits for it any more, if the call was interrupted.
        let _ = done.send(work());
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
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the simulation failed; see what it printed"));
            }
        }
    }
}
