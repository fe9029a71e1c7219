//! CPU time of the stepping thread, less the time of reading it.

use cpu_time::ThreadTime;
use std::sync::OnceLock;
use std::time::Duration;

/// Number of empty measurements.
const TRIALS: usize = 2000;

/// The time of an empty measurement, the median of many: reading a thread's CPU time is a system call, a fifth of the step of
/// a ball on a floor. `empty` makes one.
pub fn overhead(known: &OnceLock<Duration>, empty: impl Fn() -> Duration) -> Duration {
    *known.get_or_init(|| {
        let mut spent: Vec<Duration> = (0..TRIALS).map(|_| empty()).collect();
        spent.sort_unstable();
        spent[TRIALS / 2]
    })
}

/// CPU time since `start`, s, less `overhead`.
pub fn spent_s(start: ThreadTime, overhead: Duration) -> f64 {
    start.elapsed().saturating_sub(overhead).as_secs_f64()
}
