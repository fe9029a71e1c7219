//! Permits for ticks: one for each core, each held for one tick, given by urgency.
//!
//! A world is stepped by the thread that holds its permit: its connection's thread, or a pacer's. A thread waits for a tick or two
//! of other worlds, never for their runs. When a tick overruns, its permit is given to another thread as well, and the system's
//! scheduler divides the cores.

use super::load::{Load, PermitUse};
use palmares_metrics::METRICS;
use parking_lot::{Mutex, MutexGuard};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Deadline of an official lockstep tick, after its request.
const OFFICIAL_PATIENCE: Duration = Duration::from_millis(20);
/// Deadline of a practice lockstep tick. It is finite, so that every tick comes first in the end.
const PRACTICE_PATIENCE: Duration = Duration::from_millis(100);

/// A permit that is held for longer is given to another thread as well. A tick takes a few milliseconds at most, so this one may
/// never end.
pub const OVERRUN: Duration = Duration::from_millis(250);

/// The order of waiting ticks; the smallest is first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Urgency {
    /// False for official realtime ticks, which come first.
    after_official_realtime: bool,
    due: Instant,
    permit_use: PermitUse,
}

impl Urgency {
    /// A tick of a realtime world.
    pub fn realtime(official: bool, due: Instant) -> Self {
        Urgency { after_official_realtime: !official, due, permit_use: PermitUse::Realtime }
    }

    /// A tick of a lockstep world.
    pub fn lockstep(official: bool, now: Instant) -> Self {
        let patience = if official { OFFICIAL_PATIENCE } else { PRACTICE_PATIENCE };
        Urgency { after_official_realtime: true, due: now + patience, permit_use: PermitUse::Lockstep }
    }
}

/// A waiting tick. The order of arrival decides between equal urgencies.
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
    /// Permits that are held: number and start. Together with the free ones they are as many as cores.
    held: Vec<(u64, Instant)>,
    /// Number of permits given.
    given: u64,
    /// Ticks that continue without a permit after an overrun.
    overrun: usize,
}

impl Queue {
    /// Counts a permit as held. Returns its number.
    fn hold(&mut self, now: Instant) -> u64 {
        self.given += 1;
        self.held.push((self.given, now));
        self.given
    }

    /// Ends the holding of a permit. Returns whether it still counted, which it does not after an overrun.
    fn release(&mut self, number: u64) -> bool {
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
    /// Gives a released permit to the next waiting tick.
    fn pass_on(self: &Arc<Self>) {
        loop {
            let mut queue = self.queue.lock();
            let Some(next) = queue.waiting.pop() else {
                queue.free += 1;
                return;
            };
            let since = Instant::now();
            let number = queue.hold(since);
            drop(queue);
            let permit_use = next.key.0.0.permit_use;
            match next.permit.send(Permit { shared: Some(self.clone()), number, since, permit_use }) {
                Ok(()) => return,
                // The waiter was dropped: the next one gets the permit.
                Err(mut unwanted) => {
                    unwanted.shared = None;
                    self.queue.lock().release(number);
                }
            }
        }
    }
}

/// Gives permits.
#[derive(Clone)]
pub struct Scheduler(Arc<Shared>);

impl std::fmt::Debug for Scheduler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scheduler of {} cores", self.0.cores)
    }
}

/// The right to compute one tick. Dropping it passes it on.
pub struct Permit {
    /// None when the permit was passed on unused.
    shared: Option<Arc<Shared>>,
    number: u64,
    since: Instant,
    permit_use: PermitUse,
}

impl std::fmt::Debug for Permit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Permit for {:?}", self.permit_use)
    }
}

impl Scheduler {
    /// A permit for each of `cores`, at least one.
    pub fn new(cores: usize) -> Self {
        let cores = cores.max(1);
        let queue = Mutex::new(Queue { free: cores, ..Queue::default() });
        Scheduler(Arc::new(Shared { queue, load: Mutex::new(Load::new(Instant::now())), cores }))
    }

    /// Whether no tick computes or waits.
    pub fn is_idle(&self) -> bool {
        self.0.queue.lock().is_idle(self.0.cores)
    }

    /// Whether all permits are held and a tick waits.
    #[cfg(test)]
    pub fn is_exhausted(&self) -> bool {
        let queue = self.0.queue.lock();
        queue.free == 0 && !queue.waiting.is_empty()
    }

    /// A permit for work between two ticks, if no tick computes or waits.
    pub fn spare(&self) -> Option<Permit> {
        let mut queue = self.0.queue.lock();
        if !queue.is_idle(self.0.cores) {
            return None;
        }
        queue.free -= 1;
        let since = Instant::now();
        let number = queue.hold(since);
        Some(Permit { shared: Some(self.0.clone()), number, since, permit_use: PermitUse::Between })
    }

    /// Gives the permits of ticks that have overrun to other threads.
    pub fn replace_overrun(&self, now: Instant) {
        let mut queue = self.0.queue.lock();
        let before = queue.held.len();
        queue.held.retain(|&(_, since)| now.saturating_duration_since(since) < OVERRUN);
        let lost = before - queue.held.len();
        queue.overrun += lost;
        drop(queue);
        (0..lost).for_each(|_| self.0.pass_on());
    }

    /// Number of permits.
    pub fn cores(&self) -> usize {
        self.0.cores
    }

    /// The load of the last seconds.
    pub fn load(&self) -> MutexGuard<'_, Load> {
        self.0.load.lock()
    }

    /// Waits for a permit; returns at once when one is free.
    pub async fn permit(&self, urgency: Urgency) -> Permit {
        let requested = Instant::now();
        let permit = match self.take(urgency) {
            Ok(permit) => permit,
            // The sender exists until the permit is sent.
            Err(waiting) => waiting.await.unwrap_or_else(|_| self.unlimited(urgency)).start(),
        };
        METRICS.permit_wait.observe(permit.since - requested);
        permit
    }

    /// Waits for a permit on a thread outside the asynchronous runtime.
    pub fn permit_blocking(&self, urgency: Urgency) -> Permit {
        let requested = Instant::now();
        let permit = match self.take(urgency) {
            Ok(permit) => permit,
            Err(waiting) => waiting.blocking_recv().unwrap_or_else(|_| self.unlimited(urgency)).start(),
        };
        METRICS.permit_wait.observe(permit.since - requested);
        permit
    }

    fn take(&self, urgency: Urgency) -> Result<Permit, oneshot::Receiver<Permit>> {
        let mut queue = self.0.queue.lock();
        if queue.free > 0 {
            queue.free -= 1;
            let since = Instant::now();
            let number = queue.hold(since);
            return Ok(Permit {
                shared: Some(self.0.clone()),
                number,
                since,
                permit_use: urgency.permit_use,
            });
        }
        let (permit, waiting) = oneshot::channel();
        queue.arrivals += 1;
        let key = Reverse((urgency, queue.arrivals));
        queue.waiting.push(Waiter { key, permit });
        Err(waiting)
    }

    /// A permit that is not counted, for a lost sender, which does not happen.
    fn unlimited(&self, urgency: Urgency) -> Permit {
        Permit { shared: None, number: 0, since: Instant::now(), permit_use: urgency.permit_use }
    }
}

impl Permit {
    /// Starts the time of the permit now.
    fn start(mut self) -> Self {
        self.since = Instant::now();
        self
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let Some(shared) = self.shared.take() else { return };
        let now = Instant::now();
        shared.load.lock().computed(now, self.permit_use, now - self.since);
        let mut queue = shared.queue.lock();
        if queue.release(self.number) {
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
        let (sender, mut order) = tokio::sync::mpsc::unbounded_channel();
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
            let (scheduler, sender) = (scheduler.clone(), sender.clone());
            tokio::spawn(async move {
                let _permit = scheduler.permit(urgency).await;
                let _ = sender.send(name);
            });
            // The task joins the queue.
            tokio::task::yield_now().await;
        }
        drop(held);
        let mut given_to = Vec::new();
        for _ in 0..waiters.len() {
            given_to.push(order.recv().await.expect("all come"));
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
        assert_eq!(given_to, expected);
    }

    fn waits<T>(future: std::pin::Pin<&mut impl Future<Output = T>>) -> bool {
        future.poll(&mut std::task::Context::from_waker(std::task::Waker::noop())).is_pending()
    }

    #[tokio::test]
    async fn a_dropped_waiter_costs_no_permit() {
        let scheduler = Scheduler::new(1);
        let urgency = Urgency::lockstep(false, Instant::now());
        let held = scheduler.permit(urgency).await;
        let mut gone = Box::pin(scheduler.permit(urgency));
        assert!(waits(gone.as_mut()));
        let mut sent = Box::pin(scheduler.permit(urgency));
        assert!(waits(sent.as_mut()));
        drop(gone);
        drop(held);
        // This one was sent its permit and is dropped without taking it.
        drop(sent);
        let again = tokio::time::timeout(Duration::from_secs(5), scheduler.permit(urgency)).await;
        assert!(again.is_ok());
    }

    #[tokio::test]
    async fn endless_ticks_do_not_keep_others_waiting() {
        let scheduler = Scheduler::new(2);
        let urgency = Urgency::lockstep(false, Instant::now());
        let stuck = [scheduler.permit(urgency).await, scheduler.permit(urgency).await];
        let mut innocent = Box::pin(scheduler.permit(urgency));
        assert!(waits(innocent.as_mut()));
        scheduler.replace_overrun(Instant::now());
        assert!(waits(innocent.as_mut()), "a tick may take a while");
        scheduler.replace_overrun(Instant::now() + OVERRUN);
        assert!(!waits(innocent.as_mut()), "given, and released");
        drop(innocent);
        assert!(scheduler.spare().is_none(), "a tick computes");
        drop(stuck);
        // A permit that comes back late is not given twice: there are two permits as before.
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
