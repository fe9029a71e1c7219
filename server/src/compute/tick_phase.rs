//! Where in time the ticks of each realtime world lie. Worlds that all began at one moment, as after a pause of the
//! whole competition, would all be due at the same moments and wait for each other; so each has a tick_phase of its own.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Gives out tick_phases that lie as far from each other as they can.
#[derive(Debug)]
pub(crate) struct TickPhases {
    epoch: Instant,
    given: AtomicU32,
}

/// One of many evenly spread moments of every period.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TickPhase {
    epoch: Instant,
    /// Part of a period, 0..1.
    part: f64,
}

impl TickPhases {
    pub(crate) fn new(epoch: Instant) -> Self {
        TickPhases { epoch, given: AtomicU32::new(0) }
    }

    /// The next tick_phase, in the order of van der Corput's sequence: of all that were given no two are closer than half of
    /// their mean distance, and those that are left when worlds have gone still lie evenly.
    pub(crate) fn next(&self) -> TickPhase {
        let number = self.given.fetch_add(1, Ordering::Relaxed);
        TickPhase { epoch: self.epoch, part: f64::from(number.reverse_bits()) / 2.0_f64.powi(32) }
    }
}

impl TickPhase {
    /// The first of its moments that is not before `now`, for ticks of `period_s`.
    pub(crate) fn not_before(self, now: Instant, period_s: f64) -> Instant {
        let periods = now.saturating_duration_since(self.epoch).as_secs_f64() / period_s;
        let whole = (periods - self.part).ceil().max(0.0);
        (self.epoch + Duration::from_secs_f64((whole + self.part) * period_s)).max(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_lie_apart_and_stay_where_they_are() {
        let (epoch, period_s) = (Instant::now(), 0.01);
        for count in 1..40_usize {
            let tick_phases = TickPhases::new(epoch);
            let later = epoch + Duration::from_secs_f64(123.456_7);
            let tick_phases: Vec<TickPhase> = (0..count).map(|_| tick_phases.next()).collect();
            let mut at: Vec<f64> = tick_phases
                .iter()
                .map(|tick_phase| (tick_phase.not_before(later, period_s) - later).as_secs_f64())
                .collect();
            assert!(at.iter().all(|at| (0.0..=period_s).contains(at)), "{at:?}");
            at.sort_by(f64::total_cmp);
            at.push(at[0] + period_s);
            let least = at.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
            assert!(least > 0.5 * period_s / count as f64 - 1e-8, "{count} tick_phases: {least}");
            for tick_phase in tick_phases {
                let first = tick_phase.not_before(later, period_s);
                let next = tick_phase.not_before(first + Duration::from_micros(1), period_s);
                assert!(((next - first).as_secs_f64() - period_s).abs() < 1e-7);
            }
        }
    }
}
