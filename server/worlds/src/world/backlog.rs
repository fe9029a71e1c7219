//! The ticks of a run that are not in the database yet, and the gate that bounds their number.
//!
//! Another host can continue a run from the ticks in the database. The world adds its ticks to the backlog and never waits for the
//! database; the shipper takes them and confirms those that are stored. If the host fails, the other ticks are lost. So a client
//! sees at most [`MAX_UNSTORED`] of them: otherwise the answer of a lockstep step waits at the gate, and a realtime world stands.

use super::sync::{Arc, AtomicBool, AtomicU64, Mutex, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// Largest number of ticks that a client may see and a failure of the host may take back: 0.25 s of a run at 100 Hz.
pub const MAX_UNSTORED: u64 = 25;

/// The session has another owner: nothing of the run can be stored from here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the session has another owner")]
pub struct Lost;

/// The ticks of a run that are not in the database yet. Clones share them.
pub struct Backlog<T> {
    ticks: Arc<Mutex<Ticks<T>>>,
    gate: Gate,
}

impl<T> Clone for Backlog<T> {
    fn clone(&self) -> Self {
        Backlog { ticks: self.ticks.clone(), gate: self.gate.clone() }
    }
}

struct Ticks<T> {
    /// The tick before the first of `waiting`.
    from: u64,
    /// Ticks that no statement has.
    waiting: Vec<T>,
    /// Ticks of the last statement, until it has succeeded.
    sent: Option<Group<T>>,
}

/// Consecutive ticks of a run.
pub struct Group<T> {
    /// The tick before the first of them.
    pub from: u64,
    /// The ticks.
    pub ticks: Arc<Vec<T>>,
}

impl<T> Clone for Group<T> {
    fn clone(&self) -> Self {
        Group { from: self.from, ticks: self.ticks.clone() }
    }
}

impl<T> Group<T> {
    /// The last of them.
    pub fn through(&self) -> u64 {
        self.from + self.ticks.len() as u64
    }
}

impl<T> Default for Backlog<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Backlog<T> {
    /// The backlog of a run at tick 0.
    pub fn new() -> Self {
        let ticks = Ticks { from: 0, waiting: Vec::new(), sent: None };
        let gate = Gate(Arc::new(GateState {
            stored: AtomicU64::new(0),
            lost: AtomicBool::new(false),
            stood_ns: AtomicU64::new(0),
            changed: Notify::new(),
        }));
        Backlog { ticks: Arc::new(Mutex::new(ticks)), gate }
    }

    /// The run's gate.
    pub fn gate(&self) -> &Gate {
        &self.gate
    }

    /// The run is at this tick, which is stored; nothing was added before.
    pub fn begin(&self, tick: u64) {
        self.ticks.lock().from = tick;
        self.gate.0.stored.store(tick, Ordering::Release);
    }

    /// Adds the run's next tick. Returns how many ticks no statement has.
    pub fn add(&self, tick: T) -> usize {
        let mut ticks = self.ticks.lock();
        ticks.waiting.push(tick);
        ticks.waiting.len()
    }

    /// The ticks to send now: those of a statement that has not succeeded, unchanged, or all that wait.
    ///
    /// A statement without an answer may succeed later all the same. With other ticks in the same row, it would then replace the
    /// row of its successor.
    pub fn take(&self) -> Option<Group<T>> {
        let mut ticks = self.ticks.lock();
        if ticks.sent.is_none() && !ticks.waiting.is_empty() {
            // The next ones fit without another allocation.
            let next = Vec::with_capacity(ticks.waiting.len());
            let taken = std::mem::replace(&mut ticks.waiting, next);
            let group = Group { from: ticks.from, ticks: Arc::new(taken) };
            ticks.from = group.through();
            ticks.sent = Some(group);
        }
        ticks.sent.clone()
    }

    /// The ticks that [`Backlog::take`] has returned last are in the database.
    pub fn confirm(&self) {
        let Some(group) = self.ticks.lock().sent.take() else { return };
        self.gate.0.stored.store(group.through(), Ordering::Release);
        self.gate.0.changed.notify_waiters();
    }

    /// The session has another owner: opens the gate for good, with [`Lost`].
    pub fn lose(&self) {
        self.gate.0.lost.store(true, Ordering::Release);
        self.gate.0.changed.notify_waiters();
    }

    /// Waits until all ticks are stored.
    ///
    /// # Errors
    /// The session has another owner.
    pub async fn all_stored(&self) -> Result<(), Lost> {
        let all_stored = || {
            let ticks = self.ticks.lock();
            ticks.waiting.is_empty() && ticks.sent.is_none()
        };
        self.gate.until(all_stored).await
    }
}

/// Bounds the ticks of a run that a client sees and that are not stored. Clones share it.
#[derive(Clone)]
pub struct Gate(Arc<GateState>);

struct GateState {
    /// The last tick in the database.
    stored: AtomicU64,
    lost: AtomicBool,
    /// Time for which the run stood since [`Gate::take_stood`], ns.
    stood_ns: AtomicU64,
    changed: Notify,
}

impl std::fmt::Debug for Gate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Gate (stored up to tick {}, lost: {})", self.stored(), self.is_lost())
    }
}

/// Adds the time until it is dropped to the time for which the run stood.
struct Standing<'a> {
    gate: &'a Gate,
    since: Instant,
}

impl Drop for Standing<'_> {
    fn drop(&mut self) {
        self.gate.add_stood(self.since.elapsed());
    }
}

impl Gate {
    /// The last tick in the database.
    pub fn stored(&self) -> u64 {
        self.0.stored.load(Ordering::Acquire)
    }

    /// Whether the client may see this tick now.
    pub fn may_show(&self, tick: u64) -> bool {
        tick <= self.stored() + MAX_UNSTORED
    }

    /// Waits until the client may see this tick. The wait counts as time for which the run stood.
    ///
    /// # Errors
    /// The session has another owner: the client must not see the tick.
    pub async fn open(&self, tick: u64) -> Result<(), Lost> {
        if self.may_show(tick) && !self.is_lost() {
            return Ok(());
        }
        let _standing = Standing { gate: self, since: Instant::now() };
        self.until(|| self.may_show(tick)).await
    }

    async fn until(&self, reached: impl Fn() -> bool) -> Result<(), Lost> {
        loop {
            let changed = self.0.changed.notified();
            tokio::pin!(changed);
            // From here on no change is missed.
            changed.as_mut().enable();
            if self.is_lost() {
                return Err(Lost);
            }
            if reached() {
                return Ok(());
            }
            changed.await;
        }
    }

    /// Whether the session has another owner.
    pub fn is_lost(&self) -> bool {
        self.0.lost.load(Ordering::Acquire)
    }

    /// Returns when the session has another owner.
    pub async fn lost(&self) {
        while self.until(|| false).await.is_ok() {}
    }

    /// The run stood for this time.
    pub fn add_stood(&self, time: Duration) {
        let ns = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        self.0.stood_ns.fetch_add(ns, Ordering::Relaxed);
    }

    /// Time for which the run stood since the last call.
    pub fn take_stood(&self) -> Duration {
        Duration::from_nanos(self.0.stood_ns.swap(0, Ordering::Relaxed))
    }
}
