//! Waiting awake. A controller in lockstep sends its next request a fraction of a millisecond after the last reply;
//! putting a thread to sleep and waking it up again takes about as long as a tick computes. So the connection looks for
//! the request a little longer before it sleeps, if that has paid lately and nobody else wants the core.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Longest time to stay awake.
const LONGEST: Duration = Duration::from_micros(500);
/// How much of the mean a new gap is.
const WEIGHT: f64 = 0.2;

/// How soon requests follow the replies of one connection.
#[derive(Clone, Debug)]
pub(super) struct GapEstimate {
    replied: Option<Instant>,
    /// Mean time from a reply to the next request, s; longer ones count as twice the longest worth waiting for.
    mean_s: f64,
}

impl GapEstimate {
    /// Nothing known: not worth waiting for.
    pub(super) fn new() -> Self {
        GapEstimate { replied: None, mean_s: 2.0 * LONGEST.as_secs_f64() }
    }

    /// A reply was sent.
    pub(super) fn replied(&mut self, now: Instant) {
        self.replied = Some(now);
    }

    /// A request came.
    pub(super) fn asked(&mut self, now: Instant) {
        if let Some(replied) = self.replied.take() {
            let gap_s = (now - replied).as_secs_f64().min(2.0 * LONGEST.as_secs_f64());
            self.mean_s += WEIGHT * (gap_s - self.mean_s);
        }
    }

    /// How long it pays to stay awake for the next request; none when it does not.
    pub(super) fn worth(&self) -> Option<Duration> {
        let span = Duration::from_secs_f64(1.5 * self.mean_s);
        (self.replied.is_some() && span <= LONGEST).then_some(span)
    }
}

/// Counts who stays awake: most of the cores are for those who compute.
#[derive(Debug, Default)]
pub(crate) struct Awake(AtomicUsize);

/// Leave to stay awake.
pub(super) struct Leave<'a>(&'a AtomicUsize);

impl Awake {
    /// Leave to stay awake, for one connection in two cores.
    pub(super) fn leave(&self, cores: usize) -> Option<Leave<'_>> {
        let leave = Leave(&self.0);
        // Counted in any case: a refused leave is given back as it is dropped.
        (self.0.fetch_add(1, Ordering::AcqRel) < cores / 2).then_some(leave)
    }
}

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_pays_only_for_those_who_have_been_quick() {
        let mut gaps = GapEstimate::new();
        let mut now = Instant::now();
        let mut go = |gaps: &mut GapEstimate, micros: u64, times: u32| {
            for _ in 0..times {
                gaps.replied(now);
                now += Duration::from_micros(micros);
                gaps.asked(now);
            }
            gaps.replied(now);
        };
        go(&mut gaps, 100, 1);
        assert_eq!(gaps.worth(), None, "once is not a habit");
        go(&mut gaps, 100, 30);
        let span = gaps.worth().expect("it pays");
        assert!((140..170).contains(&span.as_micros()), "{span:?}");
        go(&mut gaps, 20_000, 3);
        assert_eq!(gaps.worth(), None, "the controller thinks now");
    }

    #[test]
    fn one_in_two_cores_may_stay_awake() {
        let awake = Awake::default();
        assert!(awake.leave(1).is_none());
        let first = awake.leave(4).expect("free");
        let second = awake.leave(4).expect("free");
        assert!(awake.leave(4).is_none());
        drop(first);
        assert!(awake.leave(4).is_some());
        drop(second);
    }
}
