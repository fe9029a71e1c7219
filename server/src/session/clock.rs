//! How long a session lasts. Time is an argument here: the server passes its clock, tests pass numbers.

use std::time::Duration;

/// Less than this is nothing: the rounding of many sums of ticks, far below a tick, s.
const NOTHING_S: f64 = 1e-6;

/// Marks at which a team is warned, s left.
const MARKS_S: [u32; 3] = [300, 60, 10];

/// The clock of a session: the greater of wall-clock and simulated time since the first reset, so that time
/// is gained neither by disconnecting nor by simulating faster than real time.
///
/// `now` is the time since any fixed moment; it never runs backwards.
#[derive(Clone, Debug)]
pub(crate) struct SessionClock {
    limit_s: Option<f64>,
    started: Option<Duration>,
    simulated_s: f64,
    /// How many of the marks have been announced.
    announced: usize,
}

impl SessionClock {
    /// A clock that stands at zero; without a limit it never ends.
    pub(crate) fn new(limit_s: Option<f64>) -> Self {
        // A session shorter than a mark was never that far from its end: nothing to announce.
        let announced = match limit_s {
            Some(limit_s) => MARKS_S.iter().filter(|&&mark| f64::from(mark) >= limit_s).count(),
            None => MARKS_S.len(),
        };
        SessionClock { limit_s, started: None, simulated_s: 0.0, announced }
    }

    /// The session's length, s.
    pub(crate) fn limit_s(&self) -> Option<f64> {
        self.limit_s
    }

    /// Starts the clock; only the first call counts.
    pub(crate) fn start(&mut self, now: Duration) {
        self.started.get_or_insert(now);
    }

    /// Adds simulated time.
    pub(crate) fn simulate(&mut self, seconds: f64) {
        self.simulated_s += seconds;
    }

    /// Simulated time, s.
    pub(crate) fn simulated_s(&self) -> f64 {
        self.simulated_s
    }

    /// Wall-clock time since the start, s.
    pub(crate) fn wall_s(&self, now: Duration) -> f64 {
        self.started.map_or(0.0, |started| now.saturating_sub(started).as_secs_f64())
    }

    /// Time spent, s.
    pub(crate) fn elapsed_s(&self, now: Duration) -> f64 {
        self.wall_s(now).max(self.simulated_s)
    }

    /// Time left, s; none without a limit.
    pub(crate) fn left_s(&self, now: Duration) -> Option<f64> {
        let left_s = self.limit_s? - self.elapsed_s(now);
        Some(if left_s < NOTHING_S { 0.0 } else { left_s })
    }

    /// Whether the session's time is spent.
    pub(crate) fn is_over(&self, now: Duration) -> bool {
        self.left_s(now) == Some(0.0)
    }

    /// How many further ticks may be simulated before the time is spent: at least one while any is left.
    pub(crate) fn ticks_left(&self, now: Duration, tick_s: f64) -> u64 {
        match self.left_s(now) {
            Some(0.0) => 0,
            Some(left_s) => ((left_s - NOTHING_S) / tick_s).ceil().max(1.0) as u64,
            None => u64::MAX,
        }
    }

    /// The mark passed since the last call, if any; of several only the last.
    pub(crate) fn warning(&mut self, now: Duration) -> Option<u32> {
        let left_s = self.left_s(now)?;
        let passed = MARKS_S.iter().filter(|&&mark| left_s <= f64::from(mark)).count();
        if passed <= self.announced || left_s == 0.0 {
            return None;
        }
        self.announced = passed;
        Some(MARKS_S[passed - 1])
    }

    /// When the next mark or the end comes if nothing is simulated until then, from `now`.
    pub(crate) fn next_change(&self, now: Duration) -> Option<Duration> {
        self.started?;
        let left_s = self.left_s(now).filter(|&left_s| left_s > 0.0)?;
        let mark =
            MARKS_S.iter().skip(self.announced).map(|&mark| f64::from(mark)).find(|&mark| mark < left_s);
        Some(Duration::from_secs_f64(left_s - mark.unwrap_or(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Duration {
        Duration::from_secs_f64(1000.0 + seconds)
    }

    #[test]
    fn it_stands_still_until_the_first_reset() {
        let mut clock = SessionClock::new(Some(100.0));
        assert_eq!(clock.left_s(at(50.0)), Some(100.0));
        assert_eq!(clock.next_change(at(50.0)), None);
        clock.start(at(50.0));
        clock.start(at(60.0));
        assert_eq!(clock.left_s(at(70.0)), Some(80.0));
    }

    #[test]
    fn the_greater_of_wall_and_simulated_time_counts() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.simulate(30.0);
        assert_eq!(clock.elapsed_s(at(10.0)), 30.0);
        assert_eq!(clock.elapsed_s(at(40.0)), 40.0);
        clock.simulate(70.0);
        assert!(clock.is_over(at(40.0)));
        assert_eq!(clock.left_s(at(41.0)), Some(0.0));
    }

    #[test]
    fn without_a_limit_it_never_ends() {
        let mut clock = SessionClock::new(None);
        clock.start(at(0.0));
        clock.simulate(1e9);
        assert_eq!(clock.left_s(at(1e6)), None);
        assert!(!clock.is_over(at(1e6)));
        assert_eq!(clock.warning(at(1e6)), None);
        assert_eq!(clock.ticks_left(at(1e6), 0.01), u64::MAX);
    }

    #[test]
    fn each_mark_is_announced_once() {
        let mut clock = SessionClock::new(Some(1800.0));
        clock.start(at(0.0));
        assert_eq!(clock.warning(at(1499.0)), None);
        assert_eq!(clock.warning(at(1500.5)), Some(300));
        assert_eq!(clock.warning(at(1501.0)), None);
        clock.simulate(1795.0);
        assert_eq!(clock.warning(at(1501.0)), Some(10));
        assert_eq!(clock.warning(at(1799.0)), None);
        assert_eq!(clock.warning(at(1801.0)), None);
    }

    #[test]
    fn a_short_session_skips_the_marks_beyond_it() {
        let mut clock = SessionClock::new(Some(60.0));
        clock.start(at(0.0));
        assert_eq!(clock.warning(at(1.0)), None);
        assert_eq!(clock.next_change(at(1.0)), Some(Duration::from_secs(49)));
        assert_eq!(clock.warning(at(50.0)), Some(10));
        assert_eq!(clock.next_change(at(50.0)), Some(Duration::from_secs(10)));
        assert_eq!(clock.next_change(at(60.0)), None);
    }

    #[test]
    fn the_last_ticks_fit_into_what_is_left() {
        let mut clock = SessionClock::new(Some(1.0));
        clock.start(at(0.0));
        clock.simulate(0.965);
        assert_eq!(clock.ticks_left(at(0.0), 0.01), 4);
        clock.simulate(0.04);
        assert_eq!(clock.ticks_left(at(0.0), 0.01), 0);
    }
}
