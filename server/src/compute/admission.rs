//! Who may open another world: the declared maximum, and what the last seconds say. Official runs come first.

use super::load::Report;
use palmares_protocol::Mode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Part of the cores that worlds may keep busy; the rest is for the network and for what comes in bursts.
const OFFICIAL_SHARE: f64 = 0.85;
/// The same for practice, so that it is refused before it is in the way of official runs.
const PRACTICE_SHARE: f64 = 0.75;
/// While the worlds keep more than half of their share busy, another is refused when one realtime tick in a hundred is
/// later than this, s. When they keep less, lateness has another cause, which refusing would not cure.
const LATE_S: f64 = 5e-3;
/// Of all places practice leaves so many parts in four to official runs while there are any.
const PRACTICE_QUARTERS: usize = 3;
/// When to ask again after a refusal, s: about the window of the measurement.
pub(crate) const RETRY_S: f64 = 5.0;
/// Ticks per second of a world at real-time rate, for worlds not yet measured.
const RATE: f64 = 100.0;

/// Open worlds by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Open {
    /// Realtime.
    pub(crate) realtime: usize,
    /// Lockstep.
    pub(crate) lockstep: usize,
    /// Of both, those of official sessions.
    pub(crate) official: usize,
}

impl Open {
    /// All of them.
    pub(crate) fn all(self) -> usize {
        self.realtime + self.lockstep
    }
}

/// Why there is no place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum Full {
    /// The declared maximum.
    #[error("all {0} worlds of this server are in use")]
    Worlds(usize),
    /// Of the declared maximum practice may have only a part now.
    #[error("official runs are being played; all {0} worlds left to practice are in use")]
    Practice(usize),
    /// Another world would slow the others.
    #[error("the server is busy: another {what} run would slow the others ({why})")]
    Busy {
        /// The mode asked for.
        what: &'static str,
        /// What was measured.
        why: String,
    },
}

/// Whether there is room for another world.
pub(crate) fn admit(
    open: Open,
    most: usize,
    cores: usize,
    load: &Report,
    mode: Mode,
    official: bool,
) -> Result<(), Full> {
    if open.all() >= most {
        return Err(Full::Worlds(most));
    }
    let for_practice = (most * PRACTICE_QUARTERS / 4).max(1);
    if !official && open.official > 0 && open.all() >= for_practice {
        return Err(Full::Practice(for_practice));
    }
    if open.all() == 0 {
        // There is nobody to be slowed.
        return Ok(());
    }
    let share = if official { OFFICIAL_SHARE } else { PRACTICE_SHARE };
    let room = share * cores as f64;
    let busy = |why| Err(Full::Busy { what: mode.as_str(), why });
    // Cores that one more realtime world takes: what the present ones take, or what a tick costs in lockstep. Worlds
    // that were opened just now are not in the measurement yet.
    let lockstep_tick_s = load.lockstep_cores / load.lockstep_rate.max(1.0);
    let measured = load.realtime_rate / RATE;
    let each = if measured >= 1.0 { load.realtime_cores / measured } else { lockstep_tick_s * RATE };
    let realtime = load.realtime_cores.max(each * open.realtime as f64);
    let (needed, what) = match mode {
        Mode::Realtime => (realtime + each, "realtime worlds need"),
        // A lockstep world takes what is left; it must be enough for all of them to keep up with real time.
        Mode::Lockstep => (
            realtime + lockstep_tick_s * RATE * (open.lockstep + 1) as f64,
            "realtime worlds and lockstep worlds at real-time rate need",
        ),
    };
    // Practice in lockstep may become slower than real time, its worlds wait; but not where official runs are played.
    let elastic = mode == Mode::Lockstep && !official && open.official == 0;
    if needed > room && !elastic {
        return busy(format!("{what} {needed:.2} of {room:.2} cores"));
    }
    let working = load.realtime_cores + load.lockstep_cores > 0.5 * room;
    if working && load.late_p99_s > LATE_S {
        return busy(format!("one tick in a hundred is {:.1} ms late", load.late_p99_s * 1e3));
    }
    Ok(())
}

#[derive(Debug, Default)]
struct Counts {
    realtime: AtomicUsize,
    lockstep: AtomicUsize,
    official: AtomicUsize,
}

/// Counts the open worlds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Admission(Arc<Counts>);

/// The place of a world. Dropping it gives it back.
#[derive(Debug)]
pub(crate) struct Admitted {
    counts: Arc<Counts>,
    mode: Mode,
    official: bool,
}

impl Counts {
    fn of(&self, mode: Mode) -> &AtomicUsize {
        match mode {
            Mode::Realtime => &self.realtime,
            Mode::Lockstep => &self.lockstep,
        }
    }
}

impl Admission {
    /// The worlds that are open now.
    pub(crate) fn open(&self) -> Open {
        let count = |counter: &AtomicUsize| counter.load(Ordering::Acquire);
        Open {
            realtime: count(&self.0.realtime),
            lockstep: count(&self.0.lockstep),
            official: count(&self.0.official),
        }
    }

    /// Takes a place if `may` says so of the places taken before.
    pub(crate) fn take(
        &self,
        mode: Mode,
        official: bool,
        may: impl FnOnce(Open) -> Result<(), Full>,
    ) -> Result<Admitted, Full> {
        // Counted first and looked at then: of two that come at once at most one too many is refused, none let in.
        let admitted = Admitted { counts: self.0.clone(), mode, official };
        self.0.of(mode).fetch_add(1, Ordering::AcqRel);
        self.0.official.fetch_add(usize::from(official), Ordering::AcqRel);
        let mut before = self.open();
        match mode {
            Mode::Realtime => before.realtime -= 1,
            Mode::Lockstep => before.lockstep -= 1,
        }
        before.official -= usize::from(official);
        // Refused, the admission is given back as it is dropped.
        may(before).map(|()| admitted)
    }
}

impl Admitted {
    /// Whether other worlds are open.
    pub(crate) fn has_company(&self) -> bool {
        Admission(self.counts.clone()).open().all() > 1
    }
}

impl Drop for Admitted {
    fn drop(&mut self) {
        self.counts.of(self.mode).fetch_sub(1, Ordering::AcqRel);
        self.counts.official.fetch_sub(usize::from(self.official), Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(open: Open, load: &Report, mode: Mode, official: bool) -> Result<(), Full> {
        admit(open, 20, 2, load, mode, official)
    }

    #[test]
    fn the_declared_maximum_holds_for_everybody() {
        let load = Report::default();
        let open = Open { realtime: 19, ..Open::default() };
        assert_eq!(ask(open, &load, Mode::Realtime, false), Ok(()));
        let open = Open { realtime: 19, lockstep: 1, official: 0 };
        for official in [false, true] {
            assert_eq!(ask(open, &load, Mode::Lockstep, official), Err(Full::Worlds(20)));
        }
    }

    #[test]
    fn practice_leaves_places_to_official_runs() {
        let open = Open { realtime: 15, lockstep: 0, official: 1 };
        let load = Report::default();
        assert_eq!(ask(open, &load, Mode::Realtime, false), Err(Full::Practice(15)));
        assert_eq!(ask(open, &load, Mode::Realtime, true), Ok(()));
    }

    #[test]
    fn a_realtime_run_that_would_not_fit_is_refused_practice_first() {
        // Ten worlds take 1.44 of 2 cores.
        let load = Report { realtime_cores: 1.44, realtime_rate: 1000.0, ..Report::default() };
        let open = Open { realtime: 10, ..Open::default() };
        assert!(matches!(ask(open, &load, Mode::Realtime, false), Err(Full::Busy { .. })));
        assert_eq!(ask(open, &load, Mode::Realtime, true), Ok(()));
        // Two more were opened just now.
        let open = Open { realtime: 12, ..open };
        assert!(matches!(ask(open, &load, Mode::Realtime, true), Err(Full::Busy { .. })));
    }

    #[test]
    fn lockstep_takes_what_is_left_as_long_as_it_is_faster_than_real_time() {
        // One lockstep client keeps a core busy, at a quarter of a millisecond per tick.
        let load = Report { lockstep_cores: 1.0, lockstep_rate: 4000.0, ..Report::default() };
        let open = Open { lockstep: 10, ..Open::default() };
        assert_eq!(ask(open, &load, Mode::Lockstep, false), Ok(()));
        // Realtime runs come before it: what lockstep takes is not in their way.
        assert_eq!(ask(open, &load, Mode::Realtime, false), Ok(()));
        let slow = Report { lockstep_cores: 1.8, lockstep_rate: 180.0, ..load };
        let open = Open { lockstep: 1, ..Open::default() };
        assert!(matches!(ask(open, &slow, Mode::Lockstep, true), Err(Full::Busy { .. })));
        assert_eq!(ask(open, &slow, Mode::Lockstep, false), Ok(()), "practice among itself may be slow");
        let open = Open { official: 1, ..open };
        assert!(matches!(ask(open, &slow, Mode::Lockstep, false), Err(Full::Busy { .. })));
    }

    #[test]
    fn the_first_world_is_always_let_in() {
        let slow = Report { lockstep_cores: 2.0, lockstep_rate: 10.0, ..Report::default() };
        for mode in [Mode::Lockstep, Mode::Realtime] {
            assert_eq!(ask(Open::default(), &slow, mode, false), Ok(()));
        }
    }

    #[test]
    fn lateness_counts_when_the_worlds_are_its_cause() {
        let late =
            Report { realtime_cores: 1.0, realtime_rate: 2000.0, late_p99_s: 0.02, ..Report::default() };
        let open = Open { realtime: 10, ..Open::default() };
        assert!(matches!(ask(open, &late, Mode::Realtime, true), Err(Full::Busy { .. })));
        let idle = Report { realtime_cores: 0.1, ..late };
        assert_eq!(ask(open, &idle, Mode::Realtime, true), Ok(()));
    }

    #[test]
    fn a_place_is_given_back() {
        let admission = Admission::default();
        let one = |open: Open| if open.all() == 0 { Ok(()) } else { Err(Full::Worlds(1)) };
        let admitted = admission.take(Mode::Realtime, true, one).expect("free");
        assert_eq!(admission.open(), Open { realtime: 1, lockstep: 0, official: 1 });
        assert!(admission.take(Mode::Lockstep, false, one).is_err());
        drop(admitted);
        assert_eq!(admission.open(), Open::default());
    }
}
