//! This server's lease on its sessions, by a clock that no administrator sets and that counts while the machine sleeps.

use rustix::time::{ClockId, clock_gettime};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// A lease ends here before it ends in the database, so that nobody else can have taken the sessions.
const MARGIN: Duration = Duration::from_millis(200);

fn ms(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// A moment since the machine's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Moment(Duration);

impl Moment {
    /// The present moment.
    pub(crate) fn now() -> Self {
        let time = clock_gettime(ClockId::Boottime);
        let seconds = Duration::from_secs(u64::try_from(time.tv_sec).unwrap_or_default());
        Moment(seconds + Duration::from_nanos(u64::try_from(time.tv_nsec).unwrap_or_default()))
    }
}

/// A server's lease. A server that shares its database with no other needs none: its lease has no end.
#[derive(Debug)]
pub(crate) struct Lease {
    /// End, ms since the machine's start.
    until: AtomicU64,
    /// When it becomes whole, ms since the machine's start.
    whole_from: AtomicU64,
}

impl Lease {
    /// A lease without an end.
    pub(crate) fn endless() -> Self {
        Lease { until: AtomicU64::new(u64::MAX), whole_from: AtomicU64::new(0) }
    }

    /// A lease of `length` from the moment at which it was requested.
    pub(crate) fn from(requested: Moment, length: Duration) -> Self {
        let lease = Lease { until: AtomicU64::new(0), whole_from: AtomicU64::new(0) };
        lease.renew(requested, length);
        lease
    }

    /// Renews the lease, from the moment at which the renewal was requested.
    pub(crate) fn renew(&self, requested: Moment, length: Duration) {
        let until = requested.0 + length.saturating_sub(MARGIN);
        if requested.0 >= Duration::from_millis(self.until.load(Ordering::Relaxed)) {
            self.whole_from.store(ms(requested.0 + length), Ordering::Relaxed);
        }
        self.until.store(ms(until), Ordering::Relaxed);
    }

    /// Whether it has been valid for its whole length without a gap: then the other hosts have had the time to renew theirs.
    pub(crate) fn is_whole(&self) -> bool {
        self.is_valid() && Moment::now().0.as_millis() >= u128::from(self.whole_from.load(Ordering::Relaxed))
    }

    /// Whether the lease is valid.
    pub(crate) fn is_valid(&self) -> bool {
        Moment::now().0.as_millis() < u128::from(self.until.load(Ordering::Relaxed))
    }

    /// Time since the end of the lease; zero while it is valid.
    pub(crate) fn ended_for(&self) -> Duration {
        Moment::now().0.saturating_sub(Duration::from_millis(self.until.load(Ordering::Relaxed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lease_ends_before_the_database_ends_it() {
        let now = Moment::now();
        let before = |ms| Moment(now.0.saturating_sub(Duration::from_millis(ms)));
        let length = Duration::from_secs(2);
        assert!(Lease::from(now, length).is_valid());
        assert!(Lease::from(before(1500), length).is_valid());
        let ended = Lease::from(before(1850), length);
        assert!(!ended.is_valid() && ended.ended_for() >= Duration::from_millis(50));
        ended.renew(now, length);
        assert!(ended.is_valid() && ended.ended_for().is_zero());
        assert!(Lease::endless().is_valid() && Lease::endless().is_whole());
    }

    #[test]
    fn a_lease_is_whole_after_its_length_without_a_gap() {
        let now = Moment::now();
        let before = |ms| Moment(now.0.saturating_sub(Duration::from_millis(ms)));
        let length = Duration::from_secs(2);
        let late = Lease::from(before(2500), length);
        assert!(!late.is_valid() && !late.is_whole());
        late.renew(before(600), length);
        assert!(late.is_valid() && !late.is_whole(), "there was a gap");
        let gapless = Lease::from(before(2500), length);
        gapless.renew(before(1000), length);
        assert!(gapless.is_whole());
        let young = Lease::from(before(1500), length);
        young.renew(now, length);
        assert!(young.is_valid() && !young.is_whole());
    }
}
