//! Who may compute when: as many permits as there are cores, each held for one tick, handed out by urgency.
//!
//! A world is stepped where its permit is held: on its connection's thread, or on a pacer's. Whoever waits, waits
//! for a tick or two of others, never for their runs. A tick that takes longer than any tick should is counted out: its
//! permit is given to somebody else, and the system's scheduler divides the cores.

use super::load::{Kind, Load};
use crate::metrics::METRICS;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// How much later than a realtime tick that is due now an official lockstep tick is taken to be due.
const OFFICIAL_PATIENCE: Duration = Duration::from_millis(20);
/// The same for practice. Nobody waits for ever: in the end the one that has waited longest comes first.
const PRACTICE_PATIENCE: Duration = Duration::from_millis(100);

/// A permit that is held for longer is given to somebody else as well: a tick takes a few milliseconds at most, so this
/// one may never end.
pub(crate) const OVERRUN: Duration = Duration::from_millis(250);

/// How urgent a tick is; the smaller, the sooner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Urgency {
    /// Official realtime ticks come before anything else.
    after_official_realtime: bool,
    due: Instant,
    kind: Kind,
}

impl Urgency {
    /// A tick of a world that follows the wall clock.
    pub(crate) fn realtime(official: bool, due: Instant) -> Self {
        Urgency { after_official_realtime: !official, due, kind: Kind::Realtime }
    }

    /// A tick that a controller waits for.
    pub(crate) fn lockstep(official: bool, now: Instant) -> Self {
        let patience = if official { OFFICIAL_PATIENCE } else { PRACTICE_PATIENCE };
        Urgency { after_official_realtime: true, due: now + patience, kind: Kind::Lockstep }
    }
}

/// Somebody who waits. The order of arrival decides between equals.
struct Waiter {
    key: Reverse<(Urgency, u64)>,
    permit: oneshot::Sender<Permit>,
}

impl PartialEq for Waiter {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl Eq for Waiter {}
impl PartialOrd for Waiter {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Waiter {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.cmp(&other.key)
    }
}

#[derive(Default)]
struct Queue {
    free: usize,
    arrivals: u64,
    waiting: BinaryHeap<Waiter>,
    /// Permits that are held: their numbers, and since when. With the free ones as many as there are cores.
    held: Vec<(u64, Instant)>,
    /// Permits given so far.
    given: u64,
    /// Ticks that go on without a permit because they overran.
    overrun: usize,
}

impl Queue {
    /// Counts a permit as held from now on. Returns its number.
    fn hold(&mut self, now: Instant) -> u64 {
        self.given += 1;
        self.held.push((self.given, now));
        self.given
    }

    /// The permit is not held any more. Whether it counted until now: it does not after an overrun.
    fn let_go(&mut self, number: u64) -> bool {
        let place = self.held.iter().position(|&(held, _)| held == number);
        place.map(|place| self.held.swap_remove(place)).is_some()
    }

    fn is_idle(&self, cores: usize) -> bool {
        self.free == cores && self.overrun == 0
    }
}

struct Shared {
    queue: Mutex<Queue>,
    load: Mutex<Load>,
    cores: usize,
}

impl Shared {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        // Nothing panics while it holds the lock; if something did, the queue would still be whole.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn load(&self) -> MutexGuard<'_, Load> {
        self.load.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives a permit that nobody holds any more to whoever is next.
    fn pass_on(self: &Arc<Self>) {
        loop {
            let mut queue = self.queue();
            let Some(next) = queue.waiting.pop() else {
                queue.free += 1;
                return;
            };
            let since = Instant::now();
            let number = queue.hold(since);
            drop(queue);
            let kind = next.key.0.0.kind;
            match next.permit.send(Permit { shared: Some(self.clone()), number, since, kind }) {
                Ok(()) => return,
                // Whoever waited is gone: the next one gets it.
                Err(mut unwanted) => {
                    unwanted.shared = None;
                    self.queue().let_go(number);
                }
            }
        }
    }
}

/// Hands out permits.
#[derive(Clone)]
pub(crate) struct Scheduler(Arc<Shared>);

impl std::fmt::Debug for Scheduler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scheduler of {} cores", self.0.cores)
    }
}

/// The right to compute for one tick. Dropping it hands it on.
pub(crate) struct Permit {
    /// None when the permit was handed on without having been used.
    shared: Option<Arc<Shared>>,
    number: u64,
    since: Instant,
    kind: Kind,
}

impl std::fmt::Debug for Permit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Permit for {:?}", self.kind)
    }
}

impl Scheduler {
    /// As many permits as `cores`, at least one.
    pub(crate) fn new(cores: usize) -> Self {
        let cores = cores.max(1);
        let queue = Mutex::new(Queue { free: cores, ..Queue::default() });
        Scheduler(Arc::new(Shared { queue, load: Mutex::new(Load::new(Instant::now())), cores }))
    }

    /// Whether nobody computes or waits to.
    pub(crate) fn is_idle(&self) -> bool {
        self.0.queue().is_idle(self.0.cores)
    }

    /// Whether all permits are held and somebody waits.
    #[cfg(test)]
    pub(crate) fn is_exhausted(&self) -> bool {
        let queue = self.0.queue();
        queue.free == 0 && !queue.waiting.is_empty()
    }

    /// A permit for what is computed between two ticks, while nobody else computes or waits to.
    pub(crate) fn spare(&self) -> Option<Permit> {
        let mut queue = self.0.queue();
        if !queue.is_idle(self.0.cores) {
            return None;
        }
        queue.free -= 1;
        let since = Instant::now();
        let number = queue.hold(since);
        Some(Permit { shared: Some(self.0.clone()), number, since, kind: Kind::Between })
    }

    /// Counts out the ticks that overran: what they hold goes to others.
    pub(crate) fn count_out(&self, now: Instant) {
        let mut queue = self.0.queue();
        let before = queue.held.len();
        queue.held.retain(|&(_, since)| now.saturating_duration_since(since) < OVERRUN);
        let lost = before - queue.held.len();
        queue.overrun += lost;
        drop(queue);
        (0..lost).for_each(|_| self.0.pass_on());
    }

    /// How many permits there are.
    pub(crate) fn cores(&self) -> usize {
        self.0.cores
    }

    /// What was computed in the last seconds.
    pub(crate) fn load(&self) -> MutexGuard<'_, Load> {
        self.0.load()
    }

    /// Waits for a permit; at once when one is free.
    pub(crate) async fn permit(&self, urgency: Urgency) -> Permit {
        let asked = Instant::now();
        let permit = match self.take(urgency) {
            Ok(permit) => permit,
            // The sender lives until the permit is sent.
            Err(waiting) => waiting.await.unwrap_or_else(|_| self.unlimited(urgency)).start(),
        };
        METRICS.waited(permit.since - asked);
        permit
    }

    /// The same, for a thread outside the asynchronous runtime.
    pub(crate) fn permit_blocking(&self, urgency: Urgency) -> Permit {
        let asked = Instant::now();
        let permit = match self.take(urgency) {
            Ok(permit) => permit,
            Err(waiting) => waiting.blocking_recv().unwrap_or_else(|_| self.unlimited(urgency)).start(),
        };
        METRICS.waited(permit.since - asked);
        permit
    }

    fn take(&self, urgency: Urgency) -> Result<Permit, oneshot::Receiver<Permit>> {
        let mut queue = self.0.queue();
        if queue.free > 0 {
            queue.free -= 1;
            let since = Instant::now();
            let number = queue.hold(since);
            return Ok(Permit { shared: Some(self.0.clone()), number, since, kind: urgency.kind });
        }
        let (permit, waiting) = oneshot::channel();
        queue.arrivals += 1;
        let key = Reverse((urgency, queue.arrivals));
        queue.waiting.push(Waiter { key, permit });
        Err(waiting)
    }

    /// A permit that nobody counts: for a queue that has lost its waiter, which does not happen.
    fn unlimited(&self, urgency: Urgency) -> Permit {
        Permit { shared: None, number: 0, since: Instant::now(), kind: urgency.kind }
    }
}

impl Permit {
    /// The computing begins now.
    fn start(mut self) -> Self {
        self.since = Instant::now();
        self
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let Some(shared) = self.shared.take() else { return };
        let now = Instant::now();
        shared.load().computed(now, self.kind, now - self.since);
        let mut queue = shared.queue();
        if queue.let_go(self.number) {
            drop(queue);
            shared.pass_on();
        } else {
            queue.overrun -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn permits_go_by_urgency_and_then_by_arrival() {
        let scheduler = Scheduler::new(1);
        let now = Instant::now();
        let held = scheduler.permit(Urgency::lockstep(false, now)).await;
        let (told, mut order) = tokio::sync::mpsc::unbounded_channel();
        let waiters = [
            ("practice", Urgency::lockstep(false, now)),
            ("practice later", Urgency::lockstep(false, now)),
            ("official", Urgency::lockstep(true, now)),
            ("realtime", Urgency::realtime(false, now + Duration::from_millis(3))),
            ("realtime sooner", Urgency::realtime(false, now)),
            ("official realtime", Urgency::realtime(true, now + Duration::from_millis(9))),
            ("patience at its end", Urgency::lockstep(false, now - Duration::from_secs(1))),
        ];
        for (name, urgency) in waiters {
            let (scheduler, told) = (scheduler.clone(), told.clone());
            tokio::spawn(async move {
                let _permit = scheduler.permit(urgency).await;
                let _ = told.send(name);
            });
            // Lets the task queue up.
            tokio::task::yield_now().await;
        }
        drop(held);
        let mut seen = Vec::new();
        for _ in 0..waiters.len() {
            seen.push(order.recv().await.expect("all come"));
        }
        let expected = [
            "official realtime",
            "patience at its end",
            "realtime sooner",
            "realtime",
            "official",
            "practice",
            "practice later",
        ];
        assert_eq!(seen, expected);
    }

    fn waits<T>(future: std::pin::Pin<&mut impl Future<Output = T>>) -> bool {
        future.poll(&mut std::task::Context::from_waker(std::task::Waker::noop())).is_pending()
    }

    #[tokio::test]
    async fn who_gives_up_waiting_costs_nobody_a_permit() {
        let scheduler = Scheduler::new(1);
        let urgency = Urgency::lockstep(false, Instant::now());
        let held = scheduler.permit(urgency).await;
        let mut gone = Box::pin(scheduler.permit(urgency));
        assert!(waits(gone.as_mut()));
        let mut sent = Box::pin(scheduler.permit(urgency));
        assert!(waits(sent.as_mut()));
        drop(gone);
        drop(held);
        // This one was sent its permit and never takes it.
        drop(sent);
        let again = tokio::time::timeout(Duration::from_secs(5), scheduler.permit(urgency)).await;
        assert!(again.is_ok());
    }

    #[tokio::test]
    async fn ticks_that_never_end_keep_nobody_waiting() {
        let scheduler = Scheduler::new(2);
        let urgency = Urgency::lockstep(false, Instant::now());
        let stuck = [scheduler.permit(urgency).await, scheduler.permit(urgency).await];
        let mut innocent = Box::pin(scheduler.permit(urgency));
        assert!(waits(innocent.as_mut()));
        scheduler.count_out(Instant::now());
        assert!(waits(innocent.as_mut()), "a tick may take a while");
        scheduler.count_out(Instant::now() + OVERRUN);
        assert!(!waits(innocent.as_mut()), "given, and given back");
        drop(innocent);
        assert!(scheduler.spare().is_none(), "somebody computes");
        drop(stuck);
        // What came back late is not given twice: there are two permits as before.
        let both = [scheduler.permit(urgency).await, scheduler.permit(urgency).await];
        assert!(waits(Box::pin(scheduler.permit(urgency)).as_mut()));
        drop(both);
        assert!(scheduler.spare().is_some());
    }

    #[test]
    fn a_thread_can_wait_too() {
        let scheduler = Scheduler::new(1);
        let urgency = Urgency::realtime(false, Instant::now());
        let held = scheduler.permit_blocking(urgency);
        let other = {
            let scheduler = scheduler.clone();
            std::thread::spawn(move || drop(scheduler.permit_blocking(urgency)))
        };
        std::thread::sleep(Duration::from_millis(5));
        assert!(!other.is_finished());
        drop(held);
        other.join().expect("gets its permit");
    }
}
