//! A clock that stands while the competition is paused.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Not paused.
const RUNS: u64 = u64::MAX;

/// Milliseconds since it was made, without pauses. It can be read at every step of a world: it takes no lock.
#[derive(Debug)]
pub(super) struct PausableClock {
    origin: Instant,
    /// Begin of the present pause, ms since the origin.
    paused_at: AtomicU64,
    /// Length of all earlier pauses, ms.
    paused: AtomicU64,
}

impl PausableClock {
    /// A clock that runs.
    pub(super) fn new() -> Self {
        PausableClock { origin: Instant::now(), paused_at: AtomicU64::new(RUNS), paused: AtomicU64::new(0) }
    }

    /// Its reading at this moment, ms.
    pub(super) fn at(&self, now: Instant) -> u64 {
        let now = self.since_origin(now).min(self.paused_at.load(Ordering::Relaxed));
        // A reader beside the end of a pause may find its length without its end: then it reads an earlier time.
        now.saturating_sub(self.paused.load(Ordering::Relaxed))
    }

    /// Stops it, or lets it run again. One thread at a time calls it.
    pub(super) fn set_paused(&self, paused: bool, now: Instant) {
        let since = self.paused_at.load(Ordering::Relaxed);
        let now = self.since_origin(now);
        match (since, paused) {
            (RUNS, true) => self.paused_at.store(now, Ordering::Relaxed),
            (RUNS, false) | (_, true) => {}
            (since, false) => {
                self.paused.fetch_add(now.saturating_sub(since), Ordering::Relaxed);
                self.paused_at.store(RUNS, Ordering::Relaxed);
            }
        }
    }

    fn since_origin(&self, now: Instant) -> u64 {
        u64::try_from(now.saturating_duration_since(self.origin).as_millis()).unwrap_or(RUNS - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn it_stands_during_pauses() {
        let clock = PausableClock::new();
        let at = |seconds: u64| clock.origin + Duration::from_secs(seconds);
        clock.set_paused(false, at(1));
        assert_eq!(clock.at(at(2)), 2_000);
        clock.set_paused(true, at(3));
        clock.set_paused(true, at(5));
        assert_eq!((clock.at(at(2)), clock.at(at(90))), (2_000, 3_000));
        clock.set_paused(false, at(100));
        assert_eq!(clock.at(at(101)), 4_000);
        clock.set_paused(true, at(102));
        clock.set_paused(false, at(110));
        assert_eq!(clock.at(at(111)), 6_000);
    }
}
