//! Threads that begin every tick of realtime worlds when it is due.
//!
//! The threads are outside the asynchronous runtime, whose timers have a resolution of a millisecond. One of them sleeps until the
//! next tick is due, the others until they are needed. When a tick does not end, a new thread replaces the one that computes it.

use super::background::STACK_BYTES;
use super::scheduler::OVERRUN;
use super::tick_phase::{TickPhase, TickPhases};
use parking_lot::{Condvar, Mutex};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;
use std::time::Instant;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// A world that the pacer ticks.
pub trait Paced: Send + Sync {
    /// Whether its ticks come first.
    fn official(&self) -> bool;
    /// Makes the tick that is due. Returns when the next one is due, or None after the last. `generation` is that of the entry.
    fn tick(&self, generation: u64) -> Option<Instant>;
}

struct Entry {
    key: Reverse<(Instant, u64)>,
    generation: u64,
    paced: Arc<dyn Paced>,
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}
impl Eq for Entry {}
impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.cmp(&other.key)
    }
}

#[derive(Default)]
struct Queue {
    /// Official worlds first, then the others; each by due time.
    entries: [BinaryHeap<Entry>; 2],
    arrivals: u64,
    /// Whether a thread sleeps until the next due time.
    watched: bool,
    closed: bool,
    /// Threads that compute a tick: number and start.
    busy: Vec<(u64, Instant)>,
    /// Number of threads started.
    started: u64,
}

impl Queue {
    fn next_due(&self) -> Option<Instant> {
        self.entries.iter().filter_map(|heap| heap.peek()).map(|entry| entry.key.0.0).min()
    }

    fn pop_due(&mut self, now: Instant) -> Option<Entry> {
        let due = |heap: &&mut BinaryHeap<Entry>| heap.peek().is_some_and(|entry| entry.key.0.0 <= now);
        self.entries.iter_mut().find(due)?.pop()
    }
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

impl Shared {
    fn enlist(&self, due: Instant, generation: u64, paced: Arc<dyn Paced>) {
        let mut queue = self.queue.lock();
        queue.arrivals += 1;
        let entry = Entry { key: Reverse((due, queue.arrivals)), generation, paced };
        let sooner = queue.next_due().is_none_or(|next| due < next);
        queue.entries[usize::from(!entry.paced.official())].push(entry);
        drop(queue);
        if sooner {
            // The sleeping thread must take the earlier due time.
            self.changed.notify_all();
        }
    }

    /// The thread of this number has made its tick. Returns whether it is still needed: not after it was replaced.
    fn done(&self, number: u64) -> bool {
        let mut queue = self.queue.lock();
        let place = queue.busy.iter().position(|&(busy, _)| busy == number);
        place.map(|place| queue.busy.swap_remove(place)).is_some()
    }

    /// Waits for the next tick that is due, for the thread of this number. None after the pacer was dropped.
    fn next(&self, number: u64) -> Option<Entry> {
        let mut queue = self.queue.lock();
        loop {
            if queue.closed {
                return None;
            }
            let now = Instant::now();
            if let Some(entry) = queue.pop_due(now) {
                if !queue.watched && queue.next_due().is_some() {
                    self.changed.notify_one();
                }
                queue.busy.push((number, now));
                return Some(entry);
            }
            match queue.next_due() {
                Some(due) if !queue.watched => {
                    queue.watched = true;
                    self.changed.wait_until(&mut queue, due);
                    queue.watched = false;
                }
                _ => self.changed.wait(&mut queue),
            }
        }
    }

    fn work(&self, number: u64) {
        raise_priority();
        while let Some(Entry { generation, paced, .. }) = self.next(number) {
            let next = paced.tick(generation);
            if let Some(due) = next {
                self.enlist(due, generation, paced);
            }
            if !self.done(number) {
                return;
            }
        }
    }

    /// Starts another thread.
    fn start_thread(self: &Arc<Self>) {
        let number = {
            let mut queue = self.queue.lock();
            queue.started += 1;
            queue.started
        };
        let shared = self.clone();
        let thread = std::thread::Builder::new().name("pacer".into()).stack_size(STACK_BYTES);
        if let Err(error) = thread.spawn(move || shared.work(number)) {
            tracing::error!(%error, "cannot start a thread for realtime worlds");
        }
    }
}

/// Sets real-time priority if the system permits it: to root, and within RLIMIT_RTPRIO. Otherwise the system's fair scheduler may
/// delay a thread that wakes by milliseconds. Other threads still run, since worlds are admitted for a part of the cores only.
fn raise_priority() {
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::RoundRobin);
    if let Err(error) = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, policy) {
        tracing::info!(
            ?error,
            "no realtime priority for realtime worlds: ticks may be some milliseconds late"
        );
    }
}

/// The pacer's threads. They end when this is dropped.
pub struct Pacer {
    shared: Arc<Shared>,
    phases: TickPhases,
}

impl std::fmt::Debug for Pacer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Pacer")
    }
}

impl Pacer {
    /// Starts `threads` threads, or fewer if the system refuses.
    pub fn start(threads: usize) -> Self {
        let shared = Arc::new(Shared::default());
        (0..threads.max(1)).for_each(|_| shared.start_thread());
        Pacer { shared, phases: TickPhases::new(Instant::now()) }
    }

    /// Starts new threads in place of those whose tick has overrun.
    pub fn replace_overrun(&self, now: Instant) {
        let mut queue = self.shared.queue.lock();
        let before = queue.busy.len();
        queue.busy.retain(|&(_, since)| now.saturating_duration_since(since) < OVERRUN);
        let lost = before - queue.busy.len();
        drop(queue);
        (0..lost).for_each(|_| self.shared.start_thread());
    }

    /// The phase of another world's ticks.
    pub fn next_phase(&self) -> TickPhase {
        self.phases.next()
    }

    /// The first tick of `paced` is due at `due`.
    pub fn enlist(&self, due: Instant, generation: u64, paced: Arc<dyn Paced>) {
        self.shared.enlist(due, generation, paced);
    }
}

impl Drop for Pacer {
    fn drop(&mut self) {
        self.shared.queue.lock().closed = true;
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::sync::mpsc;
    use std::time::Duration;

    /// Ticks every millisecond, `left` times.
    struct Metronome {
        start: Instant,
        done: AtomicU64,
        ticks: u64,
        report: Mutex<mpsc::Sender<(u64, Duration)>>,
    }

    impl Paced for Metronome {
        fn official(&self) -> bool {
            false
        }
        fn tick(&self, generation: u64) -> Option<Instant> {
            let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
            let report = self.report.lock();
            report.send((generation, self.start.elapsed())).expect("the test reads");
            (done < self.ticks).then(|| self.start + Duration::from_millis(done + 1))
        }
    }

    #[test]
    fn no_tick_comes_before_it_is_due_and_all_come() {
        let pacer = Pacer::start(2);
        let (report, ticks) = mpsc::channel();
        let start = Instant::now();
        for generation in 0..3 {
            let report = Mutex::new(report.clone());
            let metronome = Metronome { start, done: AtomicU64::new(0), ticks: 20, report };
            pacer.enlist(start + Duration::from_millis(1), generation, Arc::new(metronome));
        }
        drop(report);
        let mut counts = [0u32; 3];
        for (generation, at) in ticks {
            counts[generation as usize] += 1;
            assert!(at >= Duration::from_millis(counts[generation as usize].into()), "{at:?}");
        }
        assert_eq!(counts, [20; 3]);
    }

    /// A tick that ends when the other end of its channel is dropped.
    struct Endless(Mutex<mpsc::Receiver<()>>);

    impl Paced for Endless {
        fn official(&self) -> bool {
            true
        }
        fn tick(&self, _: u64) -> Option<Instant> {
            let _ = self.0.lock().recv();
            None
        }
    }

    #[test]
    fn ticks_that_never_end_do_not_stop_the_others() {
        let pacer = Pacer::start(2);
        let start = Instant::now();
        let ends: Vec<mpsc::Sender<()>> = (0..2)
            .map(|generation| {
                let (end, stuck) = mpsc::channel();
                pacer.enlist(start, generation, Arc::new(Endless(Mutex::new(stuck))));
                end
            })
            .collect();
        while pacer.shared.queue.lock().busy.len() < 2 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let (report, ticks) = mpsc::channel();
        let metronome = Metronome { start, done: AtomicU64::new(0), ticks: 3, report: Mutex::new(report) };
        pacer.enlist(start, 7, Arc::new(metronome));
        assert!(ticks.try_recv().is_err(), "all threads are busy");
        pacer.replace_overrun(Instant::now() + OVERRUN);
        for _ in 0..3 {
            assert_eq!(ticks.recv_timeout(Duration::from_secs(60)).expect("new threads tick").0, 7);
        }
        drop(ends);
    }

    #[test]
    fn official_ticks_that_are_due_come_first() {
        let shared = Shared::default();
        struct Official(bool);
        impl Paced for Official {
            fn official(&self) -> bool {
                self.0
            }
            fn tick(&self, _: u64) -> Option<Instant> {
                None
            }
        }
        let now = Instant::now();
        for (generation, official) in [(0, false), (1, true), (2, false), (3, true)] {
            shared.enlist(
                now - Duration::from_millis(10 - generation),
                generation,
                Arc::new(Official(official)),
            );
        }
        let order: Vec<u64> = (0..4).filter_map(|_| shared.next(1).map(|entry| entry.generation)).collect();
        assert_eq!(order, [1, 3, 0, 2]);
    }
}
