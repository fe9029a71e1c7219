//! Decides whether another world may open, by the configured maximum and the load of the last seconds. Official runs come first.

use super::load::LoadReport;
use palmares_protocol::Mode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Part of the cores that worlds may keep busy; the rest is for the network and for bursts.
const OFFICIAL_SHARE: f64 = 0.85;
/// The same for practice, so that practice is refused before it slows official runs.
const PRACTICE_SHARE: f64 = 0.75;
/// No further world opens while 1 % of the realtime ticks are later than this, s, and the worlds use more than half of their
/// share. Below half, lateness has another cause, which a refusal would not remove.
const LATE_S: f64 = 5e-3;
/// While an official run is open, practice may take this many quarters of all places; the rest is reserved.
const PRACTICE_QUARTERS: usize = 3;
/// Time until a refused client should try again, s: about the window of the measurement.
pub(crate) const RETRY_S: f64 = 5.0;
/// Ticks per second of a world at real-time rate, for worlds that are not measured yet.
const RATE: f64 = 100.0;

/// Number of open worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OpenWorlds {
    /// Realtime worlds.
    pub(crate) realtime: usize,
    /// Lockstep worlds.
    pub(crate) lockstep: usize,
    /// Worlds of official sessions, of both kinds.
    pub(crate) official: usize,
}

impl OpenWorlds {
    /// All worlds.
    pub(crate) fn all(self) -> usize {
        self.realtime + self.lockstep
    }
}

/// Reason why a world may not open.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum AdmissionError {
    /// The configured maximum is reached.
    #[error("all {0} worlds of this server are in use")]
    Worlds(usize),
    /// Practice has its part of the configured maximum.
    #[error("official runs are being played; all {0} worlds left to practice are in use")]
    Practice(usize),
    /// Another world would slow the others.
    #[error("the server is busy: another {what} run would slow the others ({why})")]
    Busy {
        /// The requested pacing.
        what: &'static str,
        /// The measured load.
        why: String,
    },
}

/// Decides whether another world may open.
pub(crate) fn admit(
    open: OpenWorlds,
    max: usize,
    cores: usize,
    load: &LoadReport,
    mode: Mode,
    official: bool,
) -> Result<(), AdmissionError> {
    if open.all() >= max {
        return Err(AdmissionError::Worlds(max));
    }
    let for_practice = (max * PRACTICE_QUARTERS / 4).max(1);
    if !official && open.official > 0 && open.all() >= for_practice {
        return Err(AdmissionError::Practice(for_practice));
    }
    if open.all() == 0 {
        // No other world can be slowed.
        return Ok(());
    }
    let share = if official { OFFICIAL_SHARE } else { PRACTICE_SHARE };
    let room = share * cores as f64;
    let busy = |why| Err(AdmissionError::Busy { what: mode.as_str(), why });
    // Cores of one more realtime world: the mean of the measured ones, or by the cost of a tick in lockstep. Worlds that opened
    // just now are not in the measurement yet.
    let lockstep_tick_s = load.lockstep_cores / load.lockstep_rate.max(1.0);
    let measured = load.realtime_rate / RATE;
    let each = if measured >= 1.0 { load.realtime_cores / measured } else { lockstep_tick_s * RATE };
    let realtime = load.realtime_cores.max(each * open.realtime as f64);
    let (needed, what) = match mode {
        Mode::Realtime => (realtime + each, "realtime worlds need"),
        // Lockstep worlds share the remaining cores, which must suffice for all of them at real-time rate.
        Mode::Lockstep => (
            realtime + lockstep_tick_s * RATE * (open.lockstep + 1) as f64,
            "realtime worlds and lockstep worlds at real-time rate need",
        ),
    };
    // Lockstep practice may become slower than real time, unless official runs are open.
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
struct WorldCounts {
    realtime: AtomicUsize,
    lockstep: AtomicUsize,
    official: AtomicUsize,
}

/// Counts the open worlds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Admission(Arc<WorldCounts>);

/// The place of a world. Dropping it frees the place.
#[derive(Debug)]
pub(crate) struct Admitted {
    counts: Arc<WorldCounts>,
    mode: Mode,
    official: bool,
}

impl WorldCounts {
    fn of(&self, mode: Mode) -> &AtomicUsize {
        match mode {
            Mode::Realtime => &self.realtime,
            Mode::Lockstep => &self.lockstep,
        }
    }
}

impl Admission {
    /// The worlds that are open now.
    pub(crate) fn open(&self) -> OpenWorlds {
        let count = |counter: &AtomicUsize| counter.load(Ordering::Acquire);
        OpenWorlds {
            realtime: count(&self.0.realtime),
            lockstep: count(&self.0.lockstep),
            official: count(&self.0.official),
        }
    }

    /// Takes a place if `may` accepts the number of places taken before.
    pub(crate) fn take(
        &self,
        mode: Mode,
        official: bool,
        may: impl FnOnce(OpenWorlds) -> Result<(), AdmissionError>,
    ) -> Result<Admitted, AdmissionError> {
        // Increments first, then checks: two requests at once may both be refused, but are never both admitted to the last place.
        let admitted = Admitted { counts: self.0.clone(), mode, official };
        self.0.of(mode).fetch_add(1, Ordering::AcqRel);
        self.0.official.fetch_add(usize::from(official), Ordering::AcqRel);
        let mut before = self.open();
        match mode {
            Mode::Realtime => before.realtime -= 1,
            Mode::Lockstep => before.lockstep -= 1,
        }
        before.official -= usize::from(official);
        // A refusal drops `admitted`, which frees the place.
        may(before).map(|()| admitted)
    }
}

impl Admitted {
    /// Whether other worlds are open.
    pub(crate) fn has_others(&self) -> bool {
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

    fn ask(open: OpenWorlds, load: &LoadReport, mode: Mode, official: bool) -> Result<(), AdmissionError> {
        admit(open, 20, 2, load, mode, official)
    }

    #[test]
    fn the_configured_maximum_holds_for_all() {
        let load = LoadReport::default();
        let open = OpenWorlds { realtime: 19, ..OpenWorlds::default() };
        assert_eq!(ask(open, &load, Mode::Realtime, false), Ok(()));
        let open = OpenWorlds { realtime: 19, lockstep: 1, official: 0 };
        for official in [false, true] {
            assert_eq!(ask(open, &load, Mode::Lockstep, official), Err(AdmissionError::Worlds(20)));
        }
    }

    #[test]
    fn practice_leaves_places_to_official_runs() {
        let open = OpenWorlds { realtime: 15, lockstep: 0, official: 1 };
        let load = LoadReport::default();
        assert_eq!(ask(open, &load, Mode::Realtime, false), Err(AdmissionError::Practice(15)));
        assert_eq!(ask(open, &load, Mode::Realtime, true), Ok(()));
    }

    #[test]
    fn a_realtime_run_that_would_not_fit_is_refused_practice_first() {
        // Ten worlds take 1.44 of 2 cores.
        let load = LoadReport { realtime_cores: 1.44, realtime_rate: 1000.0, ..LoadReport::default() };
        let open = OpenWorlds { realtime: 10, ..OpenWorlds::default() };
        assert!(matches!(ask(open, &load, Mode::Realtime, false), Err(AdmissionError::Busy { .. })));
        assert_eq!(ask(open, &load, Mode::Realtime, true), Ok(()));
        // Two more were opened just now.
        let open = OpenWorlds { realtime: 12, ..open };
        assert!(matches!(ask(open, &load, Mode::Realtime, true), Err(AdmissionError::Busy { .. })));
    }

    #[test]
    fn lockstep_shares_the_remaining_cores_down_to_real_time() {
        // One lockstep client keeps a core busy, at a quarter of a millisecond per tick.
        let load = LoadReport { lockstep_cores: 1.0, lockstep_rate: 4000.0, ..LoadReport::default() };
        let open = OpenWorlds { lockstep: 10, ..OpenWorlds::default() };
        assert_eq!(ask(open, &load, Mode::Lockstep, false), Ok(()));
        // Realtime ticks come first, so that lockstep does not slow them.
        assert_eq!(ask(open, &load, Mode::Realtime, false), Ok(()));
        let slow = LoadReport { lockstep_cores: 1.8, lockstep_rate: 180.0, ..load };
        let open = OpenWorlds { lockstep: 1, ..OpenWorlds::default() };
        assert!(matches!(ask(open, &slow, Mode::Lockstep, true), Err(AdmissionError::Busy { .. })));
        assert_eq!(ask(open, &slow, Mode::Lockstep, false), Ok(()), "practice alone may be slow");
        let open = OpenWorlds { official: 1, ..open };
        assert!(matches!(ask(open, &slow, Mode::Lockstep, false), Err(AdmissionError::Busy { .. })));
    }

    #[test]
    fn the_first_world_is_always_admitted() {
        let slow = LoadReport { lockstep_cores: 2.0, lockstep_rate: 10.0, ..LoadReport::default() };
        for mode in [Mode::Lockstep, Mode::Realtime] {
            assert_eq!(ask(OpenWorlds::default(), &slow, mode, false), Ok(()));
        }
    }

    #[test]
    fn lateness_counts_when_the_worlds_are_its_cause() {
        let late = LoadReport {
            realtime_cores: 1.0,
            realtime_rate: 2000.0,
            late_p99_s: 0.02,
            ..LoadReport::default()
        };
        let open = OpenWorlds { realtime: 10, ..OpenWorlds::default() };
        assert!(matches!(ask(open, &late, Mode::Realtime, true), Err(AdmissionError::Busy { .. })));
        let idle = LoadReport { realtime_cores: 0.1, ..late };
        assert_eq!(ask(open, &idle, Mode::Realtime, true), Ok(()));
    }

    #[test]
    fn a_place_is_given_back() {
        let admission = Admission::default();
        let one = |open: OpenWorlds| if open.all() == 0 { Ok(()) } else { Err(AdmissionError::Worlds(1)) };
        let admitted = admission.take(Mode::Realtime, true, one).expect("free");
        assert_eq!(admission.open(), OpenWorlds { realtime: 1, lockstep: 0, official: 1 });
        assert!(admission.take(Mode::Lockstep, false, one).is_err());
        drop(admitted);
        assert_eq!(admission.open(), OpenWorlds::default());
    }
}
