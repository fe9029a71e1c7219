//! Threads that work through a list together with the calling thread: it would only wait, and waking it takes
//! as long as a world's tick.
//!
//! For the same reason no thread sleeps between two lists in close succession, or while another thread ends
//! its last item: two threads took 19.6 µs for a tick of one of 64 worlds of the ReFlex in the air when they
//! slept, and take 18.6 µs awake. A waiting thread yields, so that other programs get the core.

use parking_lot::Mutex;
use pyo3::PyResult;
use pyo3::exceptions::PyRuntimeError;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The longest time that a thread waits awake.
const AWAKE: Duration = Duration::from_micros(200);

/// The chosen number of threads, including the calling one.
pub(crate) struct Workers {
    /// The others, if there are any.
    pool: Option<ThreadPool>,
    /// The process that they are of: a fork has none of its parent's threads.
    process: u32,
    count: usize,
    /// Number of lists until now.
    lists: Arc<AtomicU64>,
}

impl Workers {
    /// `count` of them; 0 is one for every core.
    pub(crate) fn new(count: usize) -> PyResult<Self> {
        let cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
        let count = if count == 0 { cores() } else { count };
        Ok(Workers { pool: pool(count)?, process: std::process::id(), count, lists: Arc::default() })
    }

    /// Starts the threads anew in a process that was forked: without them a list would never end.
    pub(crate) fn started(&mut self) -> PyResult<&Self> {
        let process = std::process::id();
        if self.process != process {
            // The old pool's threads are of the parent; nothing can wait for them here.
            std::mem::forget(std::mem::replace(&mut self.pool, pool(self.count)?));
            self.process = process;
        }
        Ok(self)
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Does `work` for every item, each by the thread that is free first; returns when all are done.
    pub(crate) fn each<T: Send>(&self, items: &mut [T], work: impl Fn(&mut T) + Sync) {
        let queue = Mutex::new(items.iter_mut());
        let next = || queue.lock().next();
        let run = || {
            while let Some(item) = next() {
                work(item);
            }
        };
        let Some(pool) = &self.pool else { return run() };
        let list = self.lists.fetch_add(1, Ordering::Relaxed) + 1;
        let working = AtomicUsize::new(self.count - 1);
        pool.in_place_scope(|scope| {
            for _ in 1..self.count {
                scope.spawn(|_| {
                    run();
                    working.fetch_sub(1, Ordering::Relaxed);
                });
            }
            run();
            stay_awake(|| working.load(Ordering::Relaxed) > 0);
        });
        for _ in 1..self.count {
            let lists = self.lists.clone();
            pool.spawn(move || stay_awake(|| lists.load(Ordering::Relaxed) == list));
        }
    }
}

/// The other threads of `count`.
fn pool(count: usize) -> PyResult<Option<ThreadPool>> {
    let build = || {
        ThreadPoolBuilder::new()
            .num_threads(count - 1)
            .thread_name(|k| format!("palmares {k}"))
            .build()
            .map_err(|error| PyRuntimeError::new_err(format!("threads: {error}")))
    };
    (count > 1).then(build).transpose()
}

/// Waits as long as there is something to wait `for_it`, but no longer than [`AWAKE`].
fn stay_awake(for_it: impl Fn() -> bool) {
    let begun = Instant::now();
    while for_it() && begun.elapsed() < AWAKE {
        std::thread::yield_now();
    }
}
