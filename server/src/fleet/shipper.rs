//! Stores the ticks of all official runs of this host, so that another host can continue them.
//!
//! Each run's observer copies its ticks on the world's thread. One thread sends the new ticks of all runs in one statement, at the
//! latest [`PERIOD`] after a tick, then the new snapshots in a second one. Both are refused for runs whose session has another
//! owner. The ticks are the truth; snapshots only save time.

use super::shipped_tick::{ShippedTick, encode};
use futures_util::FutureExt;
use palmares_metrics::METRICS;
use palmares_store::{Held, OwnedRun, SentSnapshot, SentTicks, ShippingConnection, Store, StoreError};
use palmares_tasks::run::Snapshot;
use palmares_tasks::{Outcome, Run};
use palmares_worlds::world::backlog::{Backlog, Gate, Lost};
use palmares_worlds::world::{RunObserver, Ticked};
use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::{Notify, watch};
use tokio::time::sleep;

/// Longest time from a tick to its statement.
const PERIOD: Duration = Duration::from_millis(100);
/// A run with this number of ticks without a statement is sent at once: the gate closes at 25.
const AT_ONCE: usize = 10;
/// Ticks between two snapshots of a run: a second of most tasks. Another host plays at most the ticks after the last one again.
const SNAPSHOT_TICKS: u64 = 100;
/// Shortest time between two snapshots of a run in lockstep, which may be faster than real time.
const SNAPSHOT_PERIOD: Duration = Duration::from_millis(250);

/// Stores the ticks of all official runs of this host. Its thread ends when this is dropped.
pub(crate) struct Shipper {
    shared: Arc<Shared>,
}

impl std::fmt::Debug for Shipper {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Shipper of {} runs", self.shared.runs.lock().len())
    }
}

struct Shared {
    runs: Mutex<BTreeMap<String, Arc<Followed>>>,
    /// Starts a round before its time.
    wake: Notify,
    /// Rounds that have ended.
    rounds: watch::Sender<u64>,
    closed: AtomicBool,
}

/// A run whose ticks are stored.
struct Followed {
    run: OwnedRun,
    backlog: Backlog<ShippedTick>,
    /// The newest snapshot that is not sent yet.
    snapshot: Mutex<Option<Snapshot>>,
    /// Whether its world is gone: it adds no more ticks.
    ended: AtomicBool,
}

impl Followed {}

impl Shared {
    /// Stops following a run. This host may follow the run again by now, as its next owner.
    fn remove(&self, followed: &Arc<Followed>) {
        let mut runs = self.runs.lock();
        if runs.get(&followed.run.run_id).is_some_and(|known| Arc::ptr_eq(known, followed)) {
            runs.remove(&followed.run.run_id);
        }
    }

    /// Returns after a round that began after the call.
    async fn whole_round(&self) {
        let mut rounds = self.rounds.subscribe();
        // One may be in progress.
        let whole = *rounds.borrow_and_update() + 2;
        while *rounds.borrow_and_update() < whole {
            self.wake.notify_one();
            // The sender is in `self`: waiting cannot fail.
            let _ = rounds.changed().await;
        }
    }
}

impl Shipper {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub(crate) fn start(store: Store) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            runs: Mutex::default(),
            wake: Notify::new(),
            rounds: watch::Sender::new(0),
            closed: AtomicBool::new(false),
        });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let rounds = Rounds { shared: shared.clone(), store, connection: None, failing: false };
        let body = move || runtime.block_on(rounds.work());
        std::thread::Builder::new().name("shipper".into()).spawn(body)?;
        Ok(Shipper { shared })
    }

    /// Follows a run of a session that this process owns: the observer stores its ticks from the one at which it is opened. The gate
    /// is for the session and the world.
    pub(crate) fn follow(&self, run_id: &str, held: &Held) -> (ShippingObserver, Gate) {
        let backlog = Backlog::new();
        let gate = backlog.gate().clone();
        let run = OwnedRun { run_id: run_id.to_owned(), held: held.clone() };
        let (snapshot, ended) = (Mutex::default(), AtomicBool::new(false));
        let followed = Arc::new(Followed { run, backlog, snapshot, ended });
        self.shared.runs.lock().insert(run_id.to_owned(), followed.clone());
        let observer = ShippingObserver {
            shared: self.shared.clone(),
            followed,
            snapshot_at: SNAPSHOT_TICKS,
            snapped: None,
        };
        (observer, gate)
    }

    /// Waits until all ticks that the run has made are stored, and its newest snapshot. Before it, the caller reports the last
    /// tick with [`palmares_worlds::world::run::World::notify_observers`].
    ///
    /// # Errors
    /// The session has another owner.
    pub(crate) async fn flush(&self, run_id: &str) -> Result<(), Lost> {
        self.all_stored(run_id).await?;
        self.shared.whole_round().await;
        Ok(())
    }

    /// Waits until all ticks that the run has made are stored.
    ///
    /// # Errors
    /// The session has another owner.
    pub(crate) async fn all_stored(&self, run_id: &str) -> Result<(), Lost> {
        let followed = self.shared.runs.lock().get(run_id).cloned();
        let Some(followed) = followed else { return Ok(()) };
        self.shared.wake.notify_one();
        followed.backlog.all_stored().await
    }

    /// Stops following a run. When this returns, no statement with its ticks is under way: its rows can be deleted.
    pub(crate) async fn forget(&self, run_id: &str, held: &Held) {
        let known = {
            let mut runs = self.shared.runs.lock();
            // This host may follow the run again, as its next owner.
            let known = runs.get(run_id).is_some_and(|followed| followed.run.held.epoch == held.epoch);
            if known {
                runs.remove(run_id);
            }
            known
        };
        if known {
            self.shared.whole_round().await;
        }
    }
}

impl Drop for Shipper {
    fn drop(&mut self) {
        self.shared.closed.store(true, Ordering::Release);
        self.shared.wake.notify_one();
    }
}

/// Copies the ticks of a run.
pub(crate) struct ShippingObserver {
    shared: Arc<Shared>,
    followed: Arc<Followed>,
    /// The tick of the next snapshot.
    snapshot_at: u64,
    snapped: Option<Instant>,
}

impl RunObserver for ShippingObserver {
    fn opened(&mut self, run: &Run) {
        self.followed.backlog.begin(run.tick());
        self.snapshot_at = run.tick() + SNAPSHOT_TICKS;
    }

    fn ticked(&mut self, tick: &Ticked<'_>) {
        let run = tick.run;
        let (action, state) = (run.applied().clone(), tick.state());
        let tick = ShippedTick { action, state, events: run.events().to_vec() };
        if self.followed.backlog.add(tick) >= AT_ONCE {
            self.shared.wake.notify_one();
        }
        let now_due = run.tick() >= self.snapshot_at
            && self.snapped.is_none_or(|snapped| snapped.elapsed() >= SNAPSHOT_PERIOD);
        if now_due {
            (self.snapshot_at, self.snapped) = (run.tick() + SNAPSHOT_TICKS, Some(Instant::now()));
            let snapshot = run.snapshot();
            *self.followed.snapshot.lock() = Some(snapshot);
        }
    }

    /// The result is stored with the run.
    fn finished(&mut self, _: &Run, _: &Outcome) {}
}

impl Drop for ShippingObserver {
    fn drop(&mut self) {
        self.followed.ended.store(true, Ordering::Release);
    }
}

/// The thread that sends.
struct Rounds {
    shared: Arc<Shared>,
    store: Store,
    connection: Option<ShippingConnection>,
    /// Whether the last statement has failed.
    failing: bool,
}

impl Rounds {
    async fn work(mut self) {
        while !self.shared.closed.load(Ordering::Acquire) {
            // A panic would close the gates of all runs for good.
            let done = AssertUnwindSafe(self.round()).catch_unwind().await;
            let done = done.unwrap_or_else(|_| {
                tracing::error!("a round of the shipper panicked");
                Ok(())
            });
            match done {
                Ok(()) => self.failing = false,
                Err(error) => {
                    self.connection = None;
                    if !std::mem::replace(&mut self.failing, true) {
                        tracing::warn!(%error, "ticks cannot be stored; open official runs stand until they can");
                    }
                }
            }
            self.shared.rounds.send_modify(|rounds| *rounds += 1);
            if self.failing {
                sleep(PERIOD).await;
            } else {
                tokio::select! {
                    () = self.shared.wake.notified() => {}
                    () = sleep(PERIOD) => {}
                }
            }
        }
    }

    /// Sends the new ticks of all runs, then new snapshots.
    async fn round(&mut self) -> Result<(), StoreError> {
        let runs: Vec<Arc<Followed>> = self.shared.runs.lock().values().cloned().collect();
        let mut sent = Vec::new();
        for followed in &runs {
            if let Some(group) = followed.backlog.take() {
                let (body, ticks) = (encode(&group.ticks), group.ticks.len() as u64);
                sent.push(SentTicks { run: followed.run.clone(), from_tick: group.from, ticks, body });
            } else if followed.ended.load(Ordering::Acquire) {
                self.shared.remove(followed);
            }
        }
        if !sent.is_empty() {
            let stored = self.connection().await?.store_ticks(&sent).await?;
            let sent: BTreeMap<&str, &SentTicks> =
                sent.iter().map(|sent| (sent.run.run_id.as_str(), sent)).collect();
            for followed in runs.iter().filter(|followed| sent.contains_key(followed.run.run_id.as_str())) {
                if stored.contains(&followed.run.run_id) {
                    followed.backlog.confirm();
                } else {
                    self.lose(followed);
                }
            }
        }
        self.send_snapshots(&runs).await
    }

    /// Sends the new snapshots of ticks that are stored.
    async fn send_snapshots(&mut self, runs: &[Arc<Followed>]) -> Result<(), StoreError> {
        let mut sent = Vec::new();
        for followed in runs {
            let stored = followed.backlog.gate().stored();
            let snapshot = followed.snapshot.lock().take_if(|snapshot| snapshot.tick() <= stored);
            if let Some(snapshot) = snapshot {
                let (tick, body) = (snapshot.tick(), snapshot.to_bytes());
                sent.push(SentSnapshot { run: followed.run.clone(), tick, body });
            }
        }
        if !sent.is_empty() {
            // Runs that are not this host's any more are found by their ticks.
            self.connection().await?.store_snapshots(&sent).await?;
        }
        Ok(())
    }

    async fn connection(&mut self) -> Result<&mut ShippingConnection, StoreError> {
        if self.connection.is_none() {
            self.connection = Some(self.store.shipping_connection().await?);
        }
        // Set above.
        Ok(self.connection.as_mut().expect("a connection"))
    }

    fn lose(&self, followed: &Arc<Followed>) {
        let OwnedRun { run_id, held } = &followed.run;
        tracing::warn!(run = run_id, session = held.session_id, "the session has another owner");
        METRICS.stale_writes.inc();
        held.lose();
        self.shared.remove(followed);
        followed.backlog.lose();
    }
}

#[cfg(test)]
mod tests;
