//! The clock of a session. Time is an argument: the server passes its own, tests pass numbers.

use std::time::Duration;

/// Time left below this counts as zero, s: it is rounding of many sums of ticks, far below a tick.
const ROUNDING_S: f64 = 1e-6;

/// Time left at which a team is warned, s.
const MARKS_S: [u32; 3] = [300, 60, 10];

/// A stopped clock, as it is saved, and restored after the server was down.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockState {
    /// Whether the first reset has happened.
    pub started: bool,
    /// Both times, without refunds.
    pub spent: Spent,
    /// Time given back, s.
    pub refunded_s: f64,
}

/// Time that a session or a run has spent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Wall-clock time without pauses, s.
    pub wall_s: f64,
    /// Simulated time, s.
    pub simulated_s: f64,
}

impl Spent {
    /// The greater of both times, which the clock counts, s.
    pub fn counts_s(self) -> f64 {
        self.wall_s.max(self.simulated_s)
    }

    /// Time spent since `earlier`.
    pub fn since(self, earlier: Spent) -> Spent {
        Spent {
            wall_s: (self.wall_s - earlier.wall_s).max(0.0),
            simulated_s: (self.simulated_s - earlier.simulated_s).max(0.0),
        }
    }
}

/// The clock of a session: the greater of wall-clock and simulated time since the first reset, so that a team gains time
/// neither by disconnecting nor by simulating faster than real time. It stops only while an organizer pauses it, while the session
/// waits for a place, or while the server is down.
///
/// When a run is void by a fault of the server, both of its times are taken back.
///
/// `now` is the time since any fixed moment; it never runs backwards.
#[derive(Clone, Debug)]
pub struct SessionClock {
    limit_s: Option<f64>,
    started: bool,
    /// Whether an organizer has paused this session.
    paused: bool,
    /// Whether an organizer has paused the whole competition.
    competition_paused: bool,
    /// Time spent until `since`.
    spent: Spent,
    /// Since when wall-clock time passes, a later moment while the clock is held; None while it stops.
    since: Option<Duration>,
    refunded_s: f64,
    /// Number of marks that have been announced.
    announced: usize,
}

impl SessionClock {
    /// A clock at zero; without a limit it never ends.
    pub fn new(limit_s: Option<f64>) -> Self {
        let spent = Spent::default();
        let clock = SessionClock {
            limit_s,
            started: false,
            paused: false,
            competition_paused: false,
            spent,
            since: None,
            refunded_s: 0.0,
            announced: 0,
        };
        // A mark beyond the session's length is not announced.
        let announced = match limit_s {
            Some(limit_s) => MARKS_S.iter().filter(|&&mark| f64::from(mark) >= limit_s).count(),
            None => MARKS_S.len(),
        };
        SessionClock { announced, ..clock }
    }

    /// A clock that continues from where it was saved; the server was down in between.
    pub fn restored(limit_s: Option<f64>, state: &ClockState, paused: bool, now: Duration) -> Self {
        let since = (state.started && !paused).then_some(now);
        let (spent, refunded_s) = (state.spent, state.refunded_s);
        let mut clock =
            SessionClock { started: state.started, paused, spent, since, refunded_s, ..Self::new(limit_s) };
        clock.settle(now);
        // Marks that were passed before are not announced again.
        clock.announced = clock.announced.max(clock.passed(now));
        clock
    }

    /// The clock as it is saved.
    pub fn state(&self, now: Duration) -> ClockState {
        ClockState { started: self.started, spent: self.spent(now), refunded_s: self.refunded_s }
    }

    /// The session's length, s.
    pub fn limit_s(&self) -> Option<f64> {
        self.limit_s
    }

    /// Starts the clock; only the first call counts.
    pub fn start(&mut self, now: Duration) {
        if !self.started {
            self.started = true;
            self.settle(now);
        }
    }

    /// Counts wall-clock time up to now. The clock then continues unless it is paused, not started or at its end, where it
    /// stops: time that is granted or given back later can be used in full.
    fn settle(&mut self, now: Duration) {
        self.spent = self.spent(now);
        let since = self.since.take().map_or(now, |since| since.max(now));
        let runs = self.started && !self.is_paused() && !self.is_over(now);
        self.since = runs.then_some(since);
    }

    /// Stops the clock until this moment, for a session that waits for a place. It replaces an earlier moment.
    pub fn hold(&mut self, until: Duration, now: Duration) {
        self.settle(now);
        self.since = self.since.map(|_| until);
    }

    /// Stops the clock.
    pub fn pause(&mut self, now: Duration) {
        self.paused = true;
        self.settle(now);
    }

    /// Continues after a pause.
    pub fn resume(&mut self, now: Duration) {
        if self.paused {
            self.paused = false;
            self.settle(now);
        }
    }

    /// Stops the clock while the whole competition is paused, continues it afterwards.
    pub fn set_competition_paused(&mut self, paused: bool, now: Duration) {
        if self.competition_paused != paused {
            self.competition_paused = paused;
            self.settle(now);
        }
    }

    /// Makes the session longer, or shorter with negative seconds; marks that are ahead again are announced again.
    pub fn grant(&mut self, seconds: f64, now: Duration) {
        // Until now the old limit holds.
        self.settle(now);
        if let Some(limit_s) = &mut self.limit_s {
            *limit_s += seconds;
        }
        self.settle(now);
        if let Some(left_s) = self.left_s(now) {
            self.announced = MARKS_S.iter().filter(|&&mark| left_s <= f64::from(mark)).count();
        }
    }

    /// Makes the session shorter.
    pub fn shorten(&mut self, limit_s: f64, now: Duration) {
        self.settle(now);
        self.limit_s = Some(self.limit_s.map_or(limit_s, |own_s| own_s.min(limit_s)));
        self.settle(now);
        // Marks beyond the new length are not announced.
        self.announced = self.announced.max(self.passed(now));
    }

    /// Whether the first reset has happened.
    pub fn is_started(&self) -> bool {
        self.started
    }

    /// Whether an organizer has stopped it, alone or with all others.
    pub fn is_paused(&self) -> bool {
        self.paused || self.competition_paused
    }

    /// Whether an organizer has paused the whole competition.
    pub fn is_competition_paused(&self) -> bool {
        self.competition_paused
    }

    /// Adds simulated time.
    pub fn simulate(&mut self, seconds: f64, now: Duration) {
        self.spent.simulated_s += seconds;
        if self.is_over(now) {
            self.settle(now);
        }
    }

    /// Takes `seconds` from the session in addition to the time that passes: both times grow, at most to the limit.
    pub fn charge(&mut self, seconds: f64, now: Duration) {
        self.settle(now);
        let seconds = self.left_s(now).map_or(seconds, |left_s| seconds.min(left_s));
        self.spent.wall_s += seconds;
        self.spent.simulated_s += seconds;
        self.settle(now);
    }

    /// Gives back the time of a run that is void.
    pub fn refund(&mut self, run: Spent, now: Duration) {
        let before_s = self.elapsed_s(now);
        self.settle(now);
        self.spent = self.spent.since(run);
        self.settle(now);
        self.refunded_s += before_s - self.elapsed_s(now);
        // Marks that are ahead again are announced again.
        self.announced = self.announced.min(self.passed(now));
    }

    /// Takes the time of a run again that was given back.
    ///
    /// # Errors
    /// So much time is not left: the missing time, s. Nothing changes.
    pub fn take_again(&mut self, run: Spent, now: Duration) -> Result<(), f64> {
        self.settle(now);
        let wall_s = self.spent.wall_s + run.wall_s;
        let spent = Spent { wall_s, simulated_s: self.spent.simulated_s + run.simulated_s };
        let missing_s = spent.counts_s() - self.limit_s.unwrap_or(f64::INFINITY);
        if missing_s > ROUNDING_S {
            return Err(missing_s);
        }
        let before_s = self.elapsed_s(now);
        self.spent = spent;
        self.settle(now);
        self.refunded_s = (self.refunded_s - (self.elapsed_s(now) - before_s)).max(0.0);
        Ok(())
    }

    /// Both times, without refunds.
    pub fn spent(&self, now: Duration) -> Spent {
        let passed = self.since.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        let limit_s = self.limit_s.unwrap_or(f64::INFINITY);
        // The clock stops at its limit.
        let wall_s = (self.spent.wall_s + passed.as_secs_f64()).min(limit_s.max(self.spent.wall_s));
        Spent { wall_s, ..self.spent }
    }

    /// Simulated time, s.
    pub fn simulated_s(&self) -> f64 {
        self.spent.simulated_s
    }

    /// Wall-clock time since the start, without pauses, s.
    pub fn wall_s(&self, now: Duration) -> f64 {
        self.spent(now).wall_s
    }

    /// Time given back, s.
    pub fn refunded_s(&self) -> f64 {
        self.refunded_s
    }

    /// Time spent, s; at most the session's length.
    pub fn elapsed_s(&self, now: Duration) -> f64 {
        self.spent(now).counts_s().min(self.limit_s.unwrap_or(f64::INFINITY))
    }

    /// Time left, s; None without a limit.
    pub fn left_s(&self, now: Duration) -> Option<f64> {
        let left_s = self.limit_s? - self.elapsed_s(now);
        Some(if left_s < ROUNDING_S { 0.0 } else { left_s })
    }

    /// Whether the session's time is spent.
    pub fn is_over(&self, now: Duration) -> bool {
        self.left_s(now) == Some(0.0)
    }

    /// Number of further ticks before the time is spent: at least one while any time is left.
    pub fn ticks_left(&self, now: Duration, tick_s: f64) -> u64 {
        match self.left_s(now) {
            Some(0.0) => 0,
            Some(left_s) => ((left_s - ROUNDING_S) / tick_s).ceil().max(1.0) as u64,
            None => u64::MAX,
        }
    }

    /// Number of marks that have been passed.
    fn passed(&self, now: Duration) -> usize {
        let Some(left_s) = self.left_s(now) else { return MARKS_S.len() };
        MARKS_S.iter().filter(|&&mark| left_s <= f64::from(mark)).count()
    }

    /// The last mark passed since the previous call, if any.
    pub fn warning(&mut self, now: Duration) -> Option<u32> {
        let left_s = self.left_s(now)?;
        let passed = self.passed(now);
        if passed <= self.announced || left_s == 0.0 {
            return None;
        }
        self.announced = passed;
        Some(MARKS_S[passed - 1])
    }

    /// Time until the session's time is spent, if nothing is simulated until then: zero after the end, None while the clock stands.
    pub fn ends_in(&self, now: Duration) -> Option<Duration> {
        if self.is_over(now) {
            return Some(Duration::ZERO);
        }
        Some(self.since?.saturating_sub(now) + Duration::from_secs_f64(self.left_s(now)?))
    }

    /// Time until the next mark or the end, if nothing is simulated until then.
    pub fn next_change(&self, now: Duration) -> Option<Duration> {
        let held = self.since?.saturating_sub(now);
        let left_s = self.left_s(now).filter(|&left_s| left_s > 0.0)?;
        let mark =
            MARKS_S.iter().skip(self.announced).map(|&mark| f64::from(mark)).find(|&mark| mark < left_s);
        Some(held + Duration::from_secs_f64(left_s - mark.unwrap_or(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Duration {
        Duration::from_secs_f64(1000.0 + seconds)
    }

    #[test]
    fn it_stops_until_the_first_reset() {
        let mut clock = SessionClock::new(Some(100.0));
        assert_eq!(clock.left_s(at(50.0)), Some(100.0));
        assert_eq!((clock.next_change(at(50.0)), clock.ends_in(at(50.0))), (None, None));
        clock.start(at(50.0));
        assert_eq!(clock.ends_in(at(60.0)), Some(Duration::from_secs(90)));
        clock.start(at(60.0));
        assert_eq!(clock.left_s(at(70.0)), Some(80.0));
    }

    #[test]
    fn the_greater_of_wall_and_simulated_time_counts() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.simulate(30.0, at(10.0));
        assert_eq!(clock.elapsed_s(at(10.0)), 30.0);
        assert_eq!(clock.elapsed_s(at(40.0)), 40.0);
        clock.simulate(70.0, at(40.0));
        assert!(clock.is_over(at(40.0)));
        assert_eq!(clock.left_s(at(41.0)), Some(0.0));
    }

    #[test]
    fn a_charge_takes_what_it_says_but_no_more_than_is_left() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.simulate(30.0, at(10.0));
        clock.charge(10.0, at(10.0));
        assert_eq!((clock.left_s(at(10.0)), clock.left_s(at(35.0))), (Some(60.0), Some(55.0)));
        clock.refund(Spent { wall_s: 10.0, simulated_s: 10.0 }, at(35.0));
        assert_eq!((clock.left_s(at(35.0)), clock.refunded_s()), (Some(65.0), 10.0));
        clock.charge(1000.0, at(35.0));
        assert!(clock.is_over(at(35.0)));
        clock.grant(5.0, at(99.0));
        assert_eq!(clock.left_s(at(99.0)), Some(5.0));
    }

    #[test]
    fn granted_time_is_announced_like_any_other() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        assert_eq!(clock.warning(at(95.0)), Some(10));
        clock.grant(60.0, at(100.0));
        assert_eq!((clock.left_s(at(100.0)), clock.is_over(at(100.0))), (Some(60.0), false));
        assert_eq!(clock.warning(at(110.0)), None);
        assert_eq!(clock.warning(at(152.0)), Some(10));
        assert!(clock.is_over(at(160.0)));
    }

    #[test]
    fn a_pause_costs_nothing() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.pause(at(0.0));
        clock.start(at(5.0));
        assert_eq!((clock.elapsed_s(at(50.0)), clock.next_change(at(50.0))), (0.0, None));
        clock.resume(at(60.0));
        clock.pause(at(70.0));
        clock.pause(at(75.0));
        assert_eq!(clock.elapsed_s(at(90.0)), 10.0);
        clock.resume(at(100.0));
        clock.resume(at(101.0));
        assert_eq!(clock.elapsed_s(at(105.0)), 15.0);
    }

    #[test]
    fn the_pause_of_the_competition_and_that_of_the_session_are_two() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.set_competition_paused(true, at(10.0));
        clock.set_competition_paused(true, at(15.0));
        clock.pause(at(20.0));
        clock.set_competition_paused(false, at(30.0));
        assert_eq!((clock.elapsed_s(at(40.0)), clock.is_paused()), (10.0, true), "its own pause lasts");
        clock.set_competition_paused(true, at(40.0));
        clock.resume(at(50.0));
        assert_eq!((clock.elapsed_s(at(60.0)), clock.is_paused()), (10.0, true), "the other pause lasts");
        clock.set_competition_paused(false, at(60.0));
        assert_eq!((clock.elapsed_s(at(65.0)), clock.is_paused()), (15.0, false));
    }

    #[test]
    fn a_shorter_session_announces_the_marks_within_it() {
        let mut clock = SessionClock::new(Some(1800.0));
        clock.shorten(200.0, at(0.0));
        clock.shorten(900.0, at(0.0));
        clock.start(at(0.0));
        assert_eq!((clock.left_s(at(20.0)), clock.warning(at(20.0))), (Some(180.0), None));
        assert_eq!(clock.warning(at(141.0)), Some(60));
        assert!(clock.is_over(at(200.0)));
    }

    #[test]
    fn a_clock_that_is_held_stops_until_it_is_released_or_the_time_is_over() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.hold(at(5.0), at(0.0));
        clock.start(at(1.0));
        assert_eq!(clock.elapsed_s(at(2.0)), 1.0, "a clock that has not started is not held");
        clock.hold(at(20.0), at(10.0));
        assert_eq!(
            (clock.elapsed_s(at(10.0)), clock.elapsed_s(at(19.0)), clock.elapsed_s(at(25.0))),
            (9.0, 9.0, 14.0)
        );
        // 31 s until 60 s are left, after the hold.
        assert_eq!(clock.next_change(at(12.0)), Some(Duration::from_secs(8 + 31)));
        assert_eq!(clock.ends_in(at(12.0)), Some(Duration::from_secs(8 + 91)));
        // Neither a refund nor a grant ends the hold, and a later one replaces it.
        clock.refund(Spent { wall_s: 2.0, simulated_s: 0.0 }, at(15.0));
        clock.grant(7.0, at(15.0));
        assert_eq!((clock.elapsed_s(at(20.0)), clock.elapsed_s(at(21.0))), (7.0, 8.0));
        clock.hold(at(30.0), at(18.0));
        assert_eq!(clock.state(at(29.0)).spent.wall_s, 7.0);
        clock.hold(at(30.0), at(30.0));
        assert_eq!(clock.elapsed_s(at(31.0)), 8.0);
        clock.hold(at(99.0), at(31.0));
        clock.hold(at(40.0), at(40.0));
        assert_eq!(clock.elapsed_s(at(41.0)), 9.0, "it is released");
        clock.hold(at(60.0), at(41.0));
        clock.pause(at(42.0));
        assert_eq!(clock.elapsed_s(at(70.0)), 9.0);
        clock.resume(at(70.0));
        assert_eq!(clock.elapsed_s(at(71.0)), 10.0);
    }

    #[test]
    fn a_void_run_never_happened() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.simulate(95.0, at(10.0));
        assert_eq!(clock.warning(at(10.0)), Some(10));
        clock.refund(Spent { wall_s: 6.0, simulated_s: 80.0 }, at(10.0));
        assert_eq!((clock.elapsed_s(at(10.0)), clock.refunded_s()), (15.0, 80.0));
        assert_eq!(clock.elapsed_s(at(30.0)), 24.0);
        assert_eq!(clock.warning(at(97.0)), Some(10));
    }

    #[test]
    fn at_its_end_it_stops_and_time_given_then_can_be_used_in_full() {
        // Ended by wall-clock time, by simulated time.
        for (simulated_s, end_s, later_s) in [(0.0, 100.0, 20.0), (100.0, 40.0, 30.0)] {
            let mut clock = SessionClock::new(Some(100.0));
            clock.start(at(0.0));
            clock.simulate(simulated_s, at(40.0));
            assert!(clock.is_over(at(end_s)), "{simulated_s}");
            // An hour later.
            let mut granted = clock.clone();
            granted.grant(30.0, at(3600.0));
            assert_eq!((granted.left_s(at(3600.0)), granted.left_s(at(3610.0))), (Some(30.0), Some(later_s)));
            let mut paid = clock.clone();
            paid.refund(Spent { wall_s: 25.0, simulated_s: 25.0 }, at(3600.0));
            assert_eq!((paid.left_s(at(3600.0)), paid.refunded_s()), (Some(25.0), 25.0));
            assert_eq!(paid.left_s(at(3610.0)), Some(later_s - 5.0));
            let saved = clock.state(at(900.0));
            assert_eq!(SessionClock::restored(Some(100.0), &saved, false, at(9.0)).wall_s(at(99.0)), end_s);
        }
    }

    #[test]
    fn it_continues_from_where_it_was_saved() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.simulate(20.0, at(10.0));
        let state = clock.state(at(10.0));
        let later = SessionClock::restored(Some(100.0), &state, false, at(5000.0));
        assert_eq!((later.elapsed_s(at(5000.0)), later.elapsed_s(at(5015.0))), (20.0, 25.0));
        let held = SessionClock::restored(Some(100.0), &state, true, at(5000.0));
        assert_eq!(held.elapsed_s(at(5050.0)), 20.0);
    }

    #[test]
    fn without_a_limit_it_never_ends() {
        let mut clock = SessionClock::new(None);
        clock.start(at(0.0));
        clock.simulate(1e9, at(0.0));
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
        clock.simulate(1795.0, at(1501.0));
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
        assert_eq!((clock.next_change(at(60.0)), clock.ends_in(at(60.0))), (None, Some(Duration::ZERO)));
    }

    #[test]
    fn the_last_ticks_fit_into_what_is_left() {
        let mut clock = SessionClock::new(Some(1.0));
        clock.start(at(0.0));
        clock.simulate(0.965, at(0.0));
        assert_eq!(clock.ticks_left(at(0.0), 0.01), 4);
        clock.simulate(0.04, at(0.0));
        assert_eq!(clock.ticks_left(at(0.0), 0.01), 0);
    }

    #[test]
    fn time_that_was_given_back_is_taken_again_if_it_is_left() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.simulate(30.0, at(20.0));
        let (before, run) = (clock.state(at(20.0)), Spent { wall_s: 15.0, simulated_s: 25.0 });
        clock.refund(run, at(20.0));
        assert_eq!((clock.left_s(at(20.0)), clock.refunded_s()), (Some(95.0), 25.0));
        assert_eq!(clock.take_again(run, at(20.0)), Ok(()));
        assert_eq!(clock.state(at(20.0)), before);
        // Used meanwhile: nothing changes, and the missing time is said.
        clock.refund(run, at(20.0));
        clock.simulate(80.0, at(20.0));
        let used = clock.state(at(20.0));
        assert_eq!(clock.take_again(run, at(20.0)), Err(10.0));
        assert_eq!(clock.state(at(20.0)), used);
        clock.grant(10.0, at(20.0));
        assert_eq!(clock.take_again(run, at(20.0)), Ok(()));
        assert!(clock.is_over(at(20.0)));
    }

    #[test]
    fn granted_time_is_taken_back() {
        let mut clock = SessionClock::new(Some(100.0));
        clock.start(at(0.0));
        clock.grant(50.0, at(10.0));
        clock.grant(-50.0, at(20.0));
        assert_eq!(clock.left_s(at(20.0)), Some(80.0));
        // Below what is spent: the session is over.
        clock.grant(50.0, at(20.0));
        clock.grant(-50.0, at(120.0));
        assert!(clock.is_over(at(120.0)));
    }
}
