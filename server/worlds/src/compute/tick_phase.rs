//! The phase of each realtime world's ticks. Worlds that start at one moment, as after a pause of the competition, would all be due
//! at the same moments and wait for each other; so each world has a phase of its own.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Allocates evenly spaced phases.
#[derive(Debug)]
pub struct TickPhases {
    epoch: Instant,
    given: AtomicU32,
}

/// A phase: one moment of every period.
#[derive(Clone, Copy, Debug)]
pub struct TickPhase {
    epoch: Instant,
    /// Part of a period, from 0 to below 1.
    part: f64,
}

impl TickPhases {
    /// The phases of periods that begin at `epoch`.
    pub fn new(epoch: Instant) -> Self {
        TickPhases { epoch, given: AtomicU32::new(0) }
    }

    /// The next phase of the van der Corput sequence: no two phases are closer than half of their mean distance, and the remaining
    /// ones are still spread evenly after worlds have ended.
    pub fn next(&self) -> TickPhase {
        let number = self.given.fetch_add(1, Ordering::Relaxed);
        TickPhase { epoch: self.epoch, part: f64::from(number.reverse_bits()) / 2.0_f64.powi(32) }
    }
}

impl TickPhase {
    /// The first moment of this phase that is not before `now`, for ticks of `period_s`.
    pub fn not_before(self, now: Instant, period_s: f64) -> Instant {
        let periods = now.saturating_duration_since(self.epoch).as_secs_f64() / period_s;
        let whole = (periods - self.part).ceil().max(0.0);
        (self.epoch + Duration::from_secs_f64((whole + self.part) * period_s)).max(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_spaced_and_constant() {
        let (epoch, period_s) = (Instant::now(), 0.01);
        for count in 1..40_usize {
            let phases = TickPhases::new(epoch);
            let later = epoch + Duration::from_secs_f64(123.456_7);
            let phases: Vec<TickPhase> = (0..count).map(|_| phases.next()).collect();
            let mut at: Vec<f64> = phases
                .iter()
                .map(|phase| (phase.not_before(later, period_s) - later).as_secs_f64())
                .collect();
            assert!(at.iter().all(|at| (0.0..=period_s).contains(at)), "{at:?}");
            at.sort_by(f64::total_cmp);
            at.push(at[0] + period_s);
            let least = at.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
            assert!(least > 0.5 * period_s / count as f64 - 1e-8, "{count} phases: {least}");
            for phase in phases {
                let first = phase.not_before(later, period_s);
                let next = phase.not_before(first + Duration::from_micros(1), period_s);
                assert!(((next - first).as_secs_f64() - period_s).abs() < 1e-7);
            }
        }
    }
}
