//! Decides whether another world may open, by the configured maximum and the load of the last seconds. Official runs come first, and
//! sessions that were refused come before those that ask later.
//!
//! A lockstep world without a request for a while is idle. It takes memory but no computing time, and does not count against the
//! maximum. From its next step on it counts again; that step is never refused, since lockstep worlds share the cores, and realtime
//! ticks come first.

use super::load::LoadReport;
use super::open_worlds::{OpenWorlds, WorldRequest};
use super::pausable_clock::PausableClock;
use super::queue::Queue;
use palmares_protocol::Mode;
use parking_lot::Mutex;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

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
pub const RETRY_S: f64 = 5.0;
/// A lockstep world without a request for this long is idle.
const IDLE: Duration = Duration::from_secs(10);
/// Open worlds for each place, idle ones included: a bound on memory. A world of SoftHand among balls takes about
/// 1 MB, with its recorder and its connection (40 of them, resident memory of the process).
const OPEN_PER_PLACE: usize = 8;
/// Ticks per second of a world at real-time rate, for worlds that are not measured yet.
const RATE: f64 = 100.0;

/// Reason why a world may not open.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AdmissionError {
    /// The configured maximum is reached.
    #[error("all {0} worlds of this server are in use")]
    Worlds(usize),
    /// With idle worlds the bound on memory is reached.
    #[error("{0} worlds are open, most of them idle; this server opens no more")]
    Idle(usize),
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
pub fn admit(
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
    if open.with_idle() >= max * OPEN_PER_PLACE {
        return Err(AdmissionError::Idle(open.with_idle()));
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

/// A refusal.
#[derive(Clone, Debug, PartialEq)]
pub struct NoPlace {
    /// The reason.
    pub error: AdmissionError,
    /// Number of sessions that get a world before this one.
    pub ahead: usize,
}

#[derive(Debug)]
struct OpenWorld {
    mode: Mode,
    official: bool,
    /// When it was used last, by the clock.
    used: Arc<AtomicU64>,
}

/// The open worlds, and the sessions that wait for one.
#[derive(Debug, Default)]
struct Places {
    worlds: HashMap<u64, OpenWorld>,
    last_id: u64,
    queue: Queue,
}

#[derive(Debug)]
struct Shared {
    places: Mutex<Places>,
    /// Number of open worlds.
    count: AtomicUsize,
    clock: PausableClock,
}

/// Counts the open worlds, and keeps the queue of those that wait for one.
#[derive(Clone, Debug)]
pub struct Admission(Arc<Shared>);

/// The place of a world. Dropping it frees the place.
#[derive(Debug)]
pub struct Admitted {
    shared: Arc<Shared>,
    id: u64,
    used: Arc<AtomicU64>,
}

impl Shared {
    fn open(&self, places: &Places, now: Instant) -> OpenWorlds {
        let idle_since = self.clock.at(now).checked_sub(IDLE.as_millis() as u64);
        let mut open = OpenWorlds::default();
        for world in places.worlds.values() {
            let idle = idle_since.is_some_and(|since| world.used.load(Ordering::Relaxed) <= since);
            if idle && world.mode == Mode::Lockstep {
                open.idle += 1;
            } else {
                open.add(world.mode, world.official);
            }
        }
        open
    }
}

impl Default for Admission {
    fn default() -> Self {
        Admission(Arc::new(Shared {
            places: Mutex::default(),
            count: AtomicUsize::default(),
            clock: PausableClock::new(),
        }))
    }
}

impl Admission {
    /// The worlds that are open now.
    pub fn open(&self) -> OpenWorlds {
        self.0.open(&self.0.places.lock(), Instant::now())
    }

    /// The competition is paused, or continues. In a pause no world becomes idle and no session leaves the queue: nobody can ask.
    pub fn set_paused(&self, paused: bool) {
        let _one_at_a_time = self.0.places.lock();
        self.0.clock.set_paused(paused, Instant::now());
    }

    /// The sessions that wait for a world, in the order of the queue.
    pub fn waiting(&self) -> Vec<String> {
        let now = self.0.clock.at(Instant::now());
        self.0.places.lock().queue.sessions(now).map(str::to_owned).collect()
    }

    /// The place of a session in the queue, from 1; None if it does not wait.
    pub fn place_in_queue(&self, session_id: &str) -> Option<usize> {
        let now = self.0.clock.at(Instant::now());
        self.0
            .places
            .lock()
            .queue
            .sessions(now)
            .position(|waiting| waiting == session_id)
            .map(|ahead| ahead + 1)
    }

    /// Takes a place if `may` accepts the worlds that are open or will be opened by sessions before this one in the queue. A refused
    /// session enters the queue.
    pub fn take(
        &self,
        request: WorldRequest<'_>,
        now: Instant,
        may: impl FnOnce(OpenWorlds) -> Result<(), AdmissionError>,
    ) -> Result<Admitted, NoPlace> {
        let mut places = self.0.places.lock();
        let time = self.0.clock.at(now);
        places.queue.expire(time);
        let mut open = self.0.open(&places, now);
        let ahead = places.queue.ahead_of(request, &mut open);
        if let Err(error) = may(open) {
            places.queue.enter(request, time);
            return Err(NoPlace { error, ahead });
        }
        places.queue.leave(request.session_id);
        Ok(self.open_world(&mut places, request, now))
    }

    /// Takes a place without a question.
    pub fn force(&self, request: WorldRequest<'_>, now: Instant) -> Admitted {
        self.open_world(&mut self.0.places.lock(), request, now)
    }

    fn open_world(&self, places: &mut Places, request: WorldRequest<'_>, now: Instant) -> Admitted {
        let WorldRequest { mode, official, .. } = request;
        places.last_id += 1;
        let (id, used) = (places.last_id, Arc::new(AtomicU64::new(self.0.clock.at(now))));
        places.worlds.insert(id, OpenWorld { mode, official, used: used.clone() });
        self.0.count.fetch_add(1, Ordering::Relaxed);
        Admitted { shared: self.0.clone(), id, used }
    }
}

impl Admitted {
    /// Whether other worlds are open.
    pub fn has_others(&self) -> bool {
        self.shared.count.load(Ordering::Relaxed) > 1
    }

    /// Notes that the world is used: it is not idle.
    pub fn used(&self) {
        self.used.store(self.shared.clock.at(Instant::now()), Ordering::Relaxed);
    }
}

impl Drop for Admitted {
    fn drop(&mut self) {
        self.shared.places.lock().worlds.remove(&self.id);
        self.shared.count.fetch_sub(1, Ordering::Relaxed);
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
        let open = OpenWorlds { realtime: 19, lockstep: 1, ..OpenWorlds::default() };
        for official in [false, true] {
            assert_eq!(ask(open, &load, Mode::Lockstep, official), Err(AdmissionError::Worlds(20)));
        }
    }

    #[test]
    fn practice_leaves_places_to_official_runs() {
        let open = OpenWorlds { realtime: 15, official: 1, ..OpenWorlds::default() };
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

    /// Asks for a lockstep world where this many fit.
    fn take(admission: &Admission, session_id: &str, now: Instant, max: usize) -> Result<Admitted, usize> {
        let request = WorldRequest { session_id, mode: Mode::Lockstep, official: true };
        let may = |open: OpenWorlds| admit(open, max, 64, &LoadReport::default(), Mode::Lockstep, true);
        admission.take(request, now, may).map_err(|refused| refused.ahead)
    }

    #[test]
    fn a_place_is_given_back() {
        let admission = Admission::default();
        let now = Instant::now();
        let request = WorldRequest { session_id: "a", mode: Mode::Realtime, official: true };
        let admitted = admission.take(request, now, |_| Ok(())).expect("free");
        assert_eq!(admission.open(), OpenWorlds { realtime: 1, official: 1, ..OpenWorlds::default() });
        assert!(!admitted.has_others());
        assert_eq!(take(&admission, "b", now, 1).err(), Some(0));
        drop(admitted);
        assert_eq!(admission.open(), OpenWorlds::default());
    }

    #[test]
    fn a_refused_session_comes_before_later_ones() {
        let admission = Admission::default();
        let start = Instant::now();
        let at = |seconds: u64| start + Duration::from_secs(seconds);
        let [first, second] = ["a", "b"].map(|name| take(&admission, name, at(0), 2).expect("free"));
        for (k, name) in ["c", "d", "e"].into_iter().enumerate() {
            assert_eq!(take(&admission, name, at(k as u64), 2).err(), Some(k), "{name}");
        }
        assert_eq!(admission.waiting(), ["c", "d", "e"]);
        assert_eq!((admission.place_in_queue("e"), admission.place_in_queue("a")), (Some(3), None));
        drop(first);
        // The place is for the first in the queue.
        for (name, ahead) in [("a", 3), ("e", 2), ("d", 1)] {
            assert_eq!(take(&admission, name, at(5), 2).err(), Some(ahead), "{name}");
        }
        drop(second);
        // Two places are free: the second in the queue need not wait until the first asks again.
        let third = take(&admission, "d", at(6), 2).expect("the second place is for it");
        assert_eq!(take(&admission, "a", at(6), 2).err(), Some(2));
        let fourth = take(&admission, "c", at(7), 2).expect("the first place is for it");
        // `e` does not ask again in time; `a` has, and is the next.
        assert_eq!(take(&admission, "a", at(15), 2).err(), Some(0));
        assert_eq!(take(&admission, "e", at(16), 2).err(), Some(1));
        drop((third, fourth));
    }

    #[test]
    fn a_pause_of_the_competition_costs_no_place() {
        let admission = Admission::default();
        let now = Instant::now();
        let playing = take(&admission, "a", now, 1).expect("free");
        assert_eq!(take(&admission, "b", now, 1).err(), Some(0));
        admission.0.clock.set_paused(true, now + Duration::from_secs(1));
        let later = now + Duration::from_secs(600);
        admission.0.clock.set_paused(false, later);
        // The world of `a` is not idle, and `b` is still the first.
        assert_eq!(take(&admission, "c", later, 1).err(), Some(1));
        drop(playing);
        assert_eq!(take(&admission, "c", later, 1).err(), Some(1));
        let first = take(&admission, "b", later, 1).expect("the place is for it");
        drop(first);
    }

    #[test]
    fn official_sessions_come_first() {
        let admission = Admission::default();
        let now = Instant::now();
        let full = |_: OpenWorlds| Err(AdmissionError::Worlds(1));
        let ahead = |session_id, official| {
            let request = WorldRequest { session_id, mode: Mode::Lockstep, official };
            admission.take(request, now, full).expect_err("full").ahead
        };
        assert_eq!((ahead("practice", false), ahead("official", true)), (0, 0));
        assert_eq!((ahead("practice", false), ahead("official", true)), (1, 0));
    }

    #[test]
    fn an_idle_lockstep_world_leaves_its_place_until_it_is_used_again() {
        let admission = Admission::default();
        let now = Instant::now();
        let idle = take(&admission, "a", now, 1).expect("free");
        assert_eq!(take(&admission, "b", now + IDLE / 2, 1).err(), Some(0));
        let later = now + IDLE + Duration::from_secs(1);
        let busy = take(&admission, "b", later, 1).expect("the other world is idle");
        let open = admission.0.open(&admission.0.places.lock(), later);
        assert_eq!((open.all(), open.idle, open.with_idle(), busy.has_others()), (1, 1, 2, true));
        // It is used by the clock of the system; the test's clock is ahead.
        idle.used.store(admission.0.clock.at(later), Ordering::Relaxed);
        assert_eq!(admission.0.open(&admission.0.places.lock(), later).lockstep, 2);
        let request = WorldRequest { session_id: "c", mode: Mode::Realtime, official: true };
        let realtime = admission.take(request, now, |_| Ok(())).expect("free");
        let much_later = later + 2 * IDLE;
        let open = admission.0.open(&admission.0.places.lock(), much_later);
        assert_eq!((open.realtime, open.idle), (1, 2), "a realtime world is never idle");
        drop((idle, busy, realtime));
    }

    #[test]
    fn idle_worlds_have_a_bound_too() {
        let load = LoadReport::default();
        let open = OpenWorlds { idle: 20 * OPEN_PER_PLACE - 1, ..OpenWorlds::default() };
        assert_eq!(ask(open, &load, Mode::Lockstep, true), Ok(()));
        let open = OpenWorlds { idle: open.idle + 1, ..open };
        assert_eq!(ask(open, &load, Mode::Lockstep, true), Err(AdmissionError::Idle(20 * OPEN_PER_PLACE)));
    }
}
