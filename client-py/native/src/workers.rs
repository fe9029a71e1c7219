//! Threads that work through a list together with the thread that asks: it would wait else, and waking it takes as long as a
//! world's tick.

use pyo3::PyResult;
use pyo3::exceptions::PyRuntimeError;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::num::NonZero;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// As many threads as are asked for, the asking one among them.
pub(crate) struct Workers {
    /// The others, if there are any.
    pool: Option<ThreadPool>,
    count: usize,
}

impl Workers {
    /// `count` of them; 0 is one for every core.
    pub(crate) fn new(count: usize) -> PyResult<Self> {
        let cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
        let count = if count == 0 { cores() } else { count };
        let build = || {
            ThreadPoolBuilder::new()
                .num_threads(count - 1)
                .thread_name(|k| format!("palmares {k}"))
                .build()
                .map_err(|error| PyRuntimeError::new_err(format!("threads: {error}")))
        };
        let pool = (count > 1).then(build).transpose()?;
        Ok(Workers { pool, count })
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Does `work` for every item, each by the thread that is free first; returns when all are done.
    pub(crate) fn each<T: Send>(&self, items: &mut [T], work: impl Fn(&mut T) + Sync) {
        let queue = Mutex::new(items.iter_mut());
        let next = || lock(&queue).next();
        let run = || {
            while let Some(item) = next() {
                work(item);
            }
        };
        match &self.pool {
            None => run(),
            Some(pool) => pool.in_place_scope(|scope| {
                (1..self.count).for_each(|_| scope.spawn(|_| run()));
                run();
            }),
        }
    }
}

/// What a panic leaves in a queue is sound: an item is taken out before its work begins.
fn lock<T>(queue: &Mutex<T>) -> MutexGuard<'_, T> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}
