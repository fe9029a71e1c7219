//! The load by worlds in the last seconds. Time is an argument.

use std::time::{Duration, Instant};

/// Seconds of the window.
const WINDOW: usize = 4;
/// Bins of the histogram of lateness: bin k holds delays from 2^(k-1) to 2^k µs, the last bin all longer ones.
const BINS: usize = 24;

/// The use of a permit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PermitUse {
    /// A tick of a realtime world.
    Realtime,
    /// A tick of a lockstep world.
    Lockstep,
    /// Work between two ticks of a lockstep world.
    Between,
}

/// The load in one second.
#[derive(Clone, Copy, Debug, Default)]
struct Second {
    number: u64,
    realtime: Duration,
    realtime_ticks: u64,
    lockstep: Duration,
    lockstep_ticks: u64,
    late: [u32; BINS],
    latest: Duration,
}

/// The load of the last seconds.
#[derive(Clone, Debug)]
pub struct Load {
    start: Instant,
    seconds: [Second; WINDOW + 1],
}

/// The mean load of the last seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadReport {
    /// Cores kept busy by realtime worlds.
    pub realtime_cores: f64,
    /// Cores kept busy by lockstep worlds.
    pub lockstep_cores: f64,
    /// Realtime ticks per second.
    pub realtime_rate: f64,
    /// Lockstep ticks per second.
    pub lockstep_rate: f64,
    /// Median lateness of realtime ticks, s; an upper bound by powers of two.
    pub late_p50_s: f64,
    /// The 99th percentile, s.
    pub late_p99_s: f64,
    /// The maximum, s.
    pub late_max_s: f64,
}

impl Load {
    /// An empty window.
    pub fn new(now: Instant) -> Self {
        Load { start: now, seconds: [Second::default(); WINDOW + 1] }
    }

    fn number(&self, now: Instant) -> u64 {
        now.saturating_duration_since(self.start).as_secs()
    }

    fn second(&mut self, now: Instant) -> &mut Second {
        let number = self.number(now);
        let second = &mut self.seconds[number as usize % (WINDOW + 1)];
        if second.number != number {
            *second = Second { number, ..Second::default() };
        }
        second
    }

    /// A permit was held for `took`.
    pub fn computed(&mut self, now: Instant, permit_use: PermitUse, took: Duration) {
        let second = self.second(now);
        match permit_use {
            PermitUse::Realtime => {
                second.realtime += took;
                second.realtime_ticks += 1;
            }
            PermitUse::Lockstep => {
                second.lockstep += took;
                second.lockstep_ticks += 1;
            }
            PermitUse::Between => second.lockstep += took,
        }
    }

    /// A realtime tick began `late` after it was due.
    pub fn was_late(&mut self, now: Instant, late: Duration) {
        let second = self.second(now);
        let micros = u64::try_from(late.as_micros()).unwrap_or(u64::MAX);
        let bin = (u64::BITS - micros.leading_zeros()) as usize;
        second.late[bin.min(BINS - 1)] += 1;
        second.latest = second.latest.max(late);
    }

    /// The mean over the complete seconds of the window; over the current second while there are none.
    pub fn report(&self, now: Instant) -> LoadReport {
        let present = self.number(now);
        let span = present.min(WINDOW as u64).max(1);
        let first = present.saturating_sub(span);
        let last = if present == 0 { 1 } else { present };
        let mut report = LoadReport::default();
        let mut late = [0u64; BINS];
        for second in self.seconds.iter().filter(|second| (first..last).contains(&second.number)) {
            report.realtime_cores += second.realtime.as_secs_f64();
            report.lockstep_cores += second.lockstep.as_secs_f64();
            report.realtime_rate += second.realtime_ticks as f64;
            report.lockstep_rate += second.lockstep_ticks as f64;
            report.late_max_s = report.late_max_s.max(second.latest.as_secs_f64());
            late.iter_mut().zip(second.late).for_each(|(sum, count)| *sum += u64::from(count));
        }
        for sum in [
            &mut report.realtime_cores,
            &mut report.lockstep_cores,
            &mut report.realtime_rate,
            &mut report.lockstep_rate,
        ] {
            *sum /= span as f64;
        }
        report.late_p50_s = quantile(&late, 0.50).min(report.late_max_s);
        report.late_p99_s = quantile(&late, 0.99).min(report.late_max_s);
        report
    }
}

/// The upper edge of the bin that holds the quantile, s.
fn quantile(bins: &[u64; BINS], part: f64) -> f64 {
    let total: u64 = bins.iter().sum();
    let mut left = (total as f64 * part).ceil().max(1.0) as u64;
    for (k, &count) in bins.iter().enumerate() {
        if count >= left {
            return (1u64 << k) as f64 * 1e-6;
        }
        left -= count;
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_forgets() {
        let start = Instant::now();
        let at = |seconds: f64| start + Duration::from_secs_f64(seconds);
        let mut load = Load::new(start);
        for k in 0..100 {
            let now = at(0.005 + f64::from(k) * 0.01);
            load.computed(now, PermitUse::Realtime, Duration::from_millis(2));
            load.computed(now, PermitUse::Lockstep, Duration::from_micros(900));
            load.computed(now, PermitUse::Between, Duration::from_micros(100));
        }
        let report = load.report(at(1.5));
        assert!((report.realtime_cores - 0.2).abs() < 1e-9, "{report:?}");
        assert!((report.lockstep_cores - 0.1).abs() < 1e-9, "{report:?}");
        assert_eq!((report.realtime_rate, report.lockstep_rate), (100.0, 100.0));
        let later = load.report(at(4.5));
        assert!((later.realtime_cores - 0.05).abs() < 1e-9, "{later:?}");
        assert_eq!(load.report(at(5.5)), LoadReport::default());
    }

    #[test]
    fn quantiles_bound_the_lateness_from_above() {
        let start = Instant::now();
        let mut load = Load::new(start);
        for _ in 0..98 {
            load.was_late(start, Duration::from_micros(30));
        }
        for _ in 0..2 {
            load.was_late(start, Duration::from_micros(3000));
        }
        let report = load.report(start + Duration::from_millis(1500));
        assert_eq!(report.late_p50_s, 32e-6);
        assert_eq!((report.late_p99_s, report.late_max_s), (3e-3, 3e-3));
    }
}
