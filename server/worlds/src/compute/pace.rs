//! The pace of a realtime run: when each tick is due, and which action it takes when the controller is silent. Time is an
//! argument.

use std::time::{Duration, Instant};

/// Number of ticks for which the last action of a silent controller continues; then the hand holds its place.
pub const HOLD_TICKS: u32 = 50;

/// The action of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActionSource {
    /// A new action.
    Fresh,
    /// The last targets continue.
    Repeat,
    /// The hand holds its place from now on.
    Hold,
}

/// Missed and late ticks of a realtime run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tempo {
    /// Ticks without a new action.
    pub missed: u64,
    /// Ticks that began more than half a tick after they were due.
    pub late: u64,
    /// Largest delay of a tick.
    pub latest: Duration,
}

/// Due times are counted from one moment, so that delays do not add up. After a late tick the next one follows as soon as
/// possible; no tick begins before it is due.
#[derive(Clone, Debug)]
pub struct Pace {
    origin: Instant,
    tick_s: f64,
    ticks: u64,
    acted: bool,
    silent: u32,
    tempo: Tempo,
}

impl Pace {
    /// The first tick is due one tick after `origin`.
    pub fn new(origin: Instant, tick_s: f64) -> Self {
        Pace { origin, tick_s, ticks: 0, acted: false, silent: 0, tempo: Tempo::default() }
    }

    /// Time between two ticks, s.
    pub fn tick_s(&self) -> f64 {
        self.tick_s
    }

    /// When the next tick is due.
    pub fn due(&self) -> Instant {
        self.origin + Duration::from_secs_f64((self.ticks + 1) as f64 * self.tick_s)
    }

    /// Skips the time until `origin`: the next tick is due one tick after it.
    pub fn restart(&mut self, origin: Instant) {
        self.origin = origin;
        self.ticks = 0;
    }

    /// Postpones the next tick by whole ticks until after `now`. Returns by how much.
    pub fn postpone(&mut self, now: Instant) -> Duration {
        let late_s = now.saturating_duration_since(self.due()).as_secs_f64();
        let by = Duration::from_secs_f64(((late_s / self.tick_s).floor() + 1.0) * self.tick_s);
        self.origin += by;
        by
    }

    /// A tick begins at `now`. Returns its delay and the source of its action.
    pub fn begin(&mut self, now: Instant, fresh: bool) -> (Duration, ActionSource) {
        let late = now.saturating_duration_since(self.due());
        self.ticks += 1;
        self.tempo.latest = self.tempo.latest.max(late);
        self.tempo.late += u64::from(late.as_secs_f64() > 0.5 * self.tick_s);
        if fresh {
            (self.acted, self.silent) = (true, 0);
            return (late, ActionSource::Fresh);
        }
        self.tempo.missed += 1;
        self.silent = self.silent.saturating_add(1);
        // A hand that never got an action holds its place already.
        let source = if self.acted && self.silent == HOLD_TICKS + 1 {
            ActionSource::Hold
        } else {
            ActionSource::Repeat
        };
        (late, source)
    }

    /// Missed and late ticks until now.
    pub fn tempo(&self) -> Tempo {
        self.tempo
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 0.01;

    fn after(start: Instant, ticks: f64) -> Instant {
        start + Duration::from_secs_f64(ticks * TICK_S)
    }

    #[test]
    fn lateness_does_not_add_up() {
        let start = Instant::now();
        let mut pace = Pace::new(start, TICK_S);
        for k in 1..=1000 {
            assert_eq!(pace.due(), after(start, f64::from(k)));
            pace.begin(after(start, f64::from(k) + 0.4), true);
        }
        assert_eq!(pace.tempo().late, 0);
        // A delay of three ticks and a half: four ticks are due already, the next one is not.
        let now = after(start, 1004.5);
        let mut made = 0;
        while pace.due() <= now {
            pace.begin(now, true);
            made += 1;
        }
        assert_eq!((made, pace.due()), (4, after(start, 1005.0)));
        assert_eq!(pace.tempo().late, 3);
        assert_eq!(pace.tempo().missed, 0);
    }

    #[test]
    fn a_silent_controller_is_repeated_and_then_held() {
        let start = Instant::now();
        let mut pace = Pace::new(start, TICK_S);
        for _ in 0..2 * HOLD_TICKS {
            assert_eq!(pace.begin(pace.due(), false).1, ActionSource::Repeat);
        }
        for _ in 0..2 {
            assert_eq!(pace.begin(pace.due(), true).1, ActionSource::Fresh);
            for _ in 0..HOLD_TICKS {
                assert_eq!(pace.begin(pace.due(), false).1, ActionSource::Repeat);
            }
            assert_eq!(pace.begin(pace.due(), false).1, ActionSource::Hold);
            assert_eq!(pace.begin(pace.due(), false).1, ActionSource::Repeat);
        }
        assert_eq!(pace.tempo().missed, u64::from(2 * HOLD_TICKS + 2 * (HOLD_TICKS + 2)));
    }

    #[test]
    fn a_postponed_tick_is_not_late_and_keeps_the_phase() {
        let start = Instant::now();
        let mut pace = Pace::new(start, TICK_S);
        pace.begin(pace.due(), true);
        assert_eq!(pace.postpone(after(start, 2.0)), Duration::from_millis(10));
        assert_eq!(pace.due(), after(start, 3.0));
        assert_eq!(pace.postpone(after(start, 5.5)), Duration::from_millis(30));
        assert_eq!(pace.due(), after(start, 6.0));
        assert_eq!(pace.begin(after(start, 6.0), true).0, Duration::ZERO);
        assert_eq!((pace.due(), pace.tempo().late), (after(start, 7.0), 0));
    }

    #[test]
    fn a_pause_is_no_lateness() {
        let start = Instant::now();
        let mut pace = Pace::new(start, TICK_S);
        pace.begin(pace.due(), true);
        let later = after(start, 5000.0);
        pace.restart(later);
        assert_eq!(pace.due(), after(later, 1.0));
        assert_eq!(pace.begin(after(later, 1.0), true).0, Duration::ZERO);
    }
}
