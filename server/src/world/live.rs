//! A realtime world: it ticks by the clock, whether its client acts, listens, is away or not.
//!
//! The pacer steps it; the session's connection leaves actions in its inbox and takes what it streams. Neither
//! waits for the other: of what is not taken in time the oldest is dropped.

use super::pictures::Pictures;
use super::run::{StepError, World};
use crate::compute::Compute;
use crate::compute::pace::{Pace, Part, Tempo};
use crate::compute::pacer::{Paced, Pacer};
use crate::compute::scheduler::{Scheduler, Urgency};
use crate::compute::tick_phase::TickPhase;
use crate::metrics::METRICS;
use palmares_models::hand::Hand;
use palmares_tasks::run::{Shot, ShotError};
use palmares_tasks::{Action, ActionError, Observation, Reason};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tokio::sync::Notify;

/// Observations that wait for a slow client at most.
pub(crate) const STREAMED: usize = 32;

/// An observation on its way to the client.
#[derive(Debug)]
pub(crate) struct Streamed {
    /// The state.
    pub(crate) observation: Observation,
    /// Pictures of it that were asked for.
    pub(crate) pictures: Pictures,
    /// When its tick was due.
    pub(crate) due: Instant,
}

/// How a realtime run went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RealtimeStats {
    /// How well it kept its tempo.
    pub(crate) tempo: Tempo,
    /// Observations that the client did not take in time.
    pub(crate) dropped: u64,
}

/// What the controller wants, and who may tick.
struct Inbox {
    action: Option<Action>,
    /// Pictures for the next observation.
    shots: Vec<Shot>,
    /// Ticks that took their action.
    tick: u64,
    /// Whoever ticks with another number has been called off.
    turn: u64,
    paused: bool,
}

struct Ticking {
    /// None when the run has been closed.
    world: Option<World>,
    pace: Pace,
}

#[derive(Default)]
struct Stream {
    waiting: VecDeque<Streamed>,
    /// The last one that was streamed, or that of tick 0: a failed world has no other to end with.
    last: Option<Observation>,
    dropped: u64,
    over: Option<Reason>,
}

/// A realtime world.
pub(crate) struct Live {
    hand: Arc<Hand>,
    tick_phase: TickPhase,
    official: bool,
    scheduler: Scheduler,
    inbox: Mutex<Inbox>,
    ticking: Mutex<Ticking>,
    stream: Mutex<Stream>,
    news: Notify,
}

impl std::fmt::Debug for Live {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Live at tick {}", self.tick_now())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic of a world is caught before it gets here; what is locked stays whole.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Live {
    /// Sets a world at tick 0 going.
    pub(crate) fn start(
        world: World,
        hand: Arc<Hand>,
        tick_s: f64,
        official: bool,
        compute: &Compute,
    ) -> Arc<Self> {
        let tick_phase = compute.pacer.tick_phase();
        let pace = Pace::new(tick_phase.not_before(Instant::now(), tick_s), tick_s);
        let due = pace.due();
        let live = Arc::new(Self::new(world, hand, pace, tick_phase, official, compute.scheduler.clone()));
        compute.pacer.enlist(due, 0, live.clone());
        live
    }

    fn new(
        mut world: World,
        hand: Arc<Hand>,
        pace: Pace,
        tick_phase: TickPhase,
        official: bool,
        scheduler: Scheduler,
    ) -> Self {
        let last = world.observe().ok();
        Live {
            hand,
            tick_phase,
            official,
            scheduler,
            inbox: Mutex::new(Inbox { action: None, shots: vec![], tick: 0, turn: 0, paused: false }),
            ticking: Mutex::new(Ticking { world: Some(world), pace }),
            stream: Mutex::new(Stream { last, ..Stream::default() }),
            news: Notify::new(),
        }
    }

    /// The pictures that a controller asks for by these words.
    ///
    /// # Errors
    /// One of them cannot be had.
    pub(crate) fn shots(&self, cameras: &[String]) -> Result<Vec<Shot>, ShotError> {
        match cameras.is_empty() {
            true => Ok(Vec::new()),
            false => self.with_world(|world| world.shots(cameras)).unwrap_or(Ok(Vec::new())),
        }
    }

    /// Takes an action, and which pictures the next observation shall have; what it leaves out keeps what came before.
    /// Returns the tick at which it takes effect.
    pub(crate) fn act(&self, action: Action, shots: Vec<Shot>) -> Result<u64, ActionError> {
        action.check(&self.hand)?;
        let mut inbox = lock(&self.inbox);
        if !shots.is_empty() {
            inbox.shots = shots;
        }
        let next = inbox.action.get_or_insert_default();
        if action.base.is_some() {
            next.base = action.base;
        }
        if action.hand.is_some() {
            next.hand = action.hand;
        }
        Ok(inbox.tick + 1)
    }

    /// Does something with the world between two ticks. None when the run has been closed.
    pub(crate) fn with_world<T>(&self, work: impl FnOnce(&mut World) -> T) -> Option<T> {
        lock(&self.ticking).world.as_mut().map(work)
    }

    /// The current tick.
    pub(crate) fn tick_now(&self) -> u64 {
        lock(&self.inbox).tick
    }

    /// Returns when there is something to take, or the run is over.
    pub(crate) async fn news(&self) {
        self.news.notified().await;
    }

    /// The oldest observation that waits.
    pub(crate) fn pop(&self) -> Option<Streamed> {
        lock(&self.stream).waiting.pop_front()
    }

    /// Tells the news again if some were left.
    pub(crate) fn remind(&self) {
        if !lock(&self.stream).waiting.is_empty() {
            self.news.notify_one();
        }
    }

    /// Forgets all observations that wait but the last one: for a client that comes back.
    pub(crate) fn skip(&self) {
        let mut stream = lock(&self.stream);
        let old = stream.waiting.len().saturating_sub(1);
        stream.waiting.drain(..old);
        drop(stream);
        self.news.notify_one();
    }

    /// Why the run is over, when it is; then it does not tick any more.
    pub(crate) fn over(&self) -> Option<Reason> {
        lock(&self.stream).over
    }

    fn push(&self, streamed: Streamed, over: Option<Reason>) {
        let mut stream = lock(&self.stream);
        if stream.waiting.len() >= STREAMED {
            stream.waiting.pop_front();
            stream.dropped += 1;
        }
        stream.last = Some(streamed.observation.clone());
        stream.waiting.push_back(streamed);
        stream.over = over;
        drop(stream);
        self.news.notify_one();
    }

    /// The world stands still until [`Live::resume`].
    pub(crate) fn pause(&self) {
        let mut inbox = lock(&self.inbox);
        inbox.paused = true;
        inbox.turn += 1;
    }

    /// The world goes on; the time it stood still does not count. Waits for a tick that is being made.
    pub(crate) fn resume(self: &Arc<Self>, pacer: &Pacer) {
        let mut ticking = lock(&self.ticking);
        let mut inbox = lock(&self.inbox);
        if !inbox.paused || ticking.world.is_none() {
            return;
        }
        inbox.paused = false;
        let origin = self.tick_phase.not_before(Instant::now(), ticking.pace.tick_s());
        ticking.pace.restart(origin);
        let (due, turn) = (ticking.pace.due(), inbox.turn);
        drop((ticking, inbox));
        pacer.enlist(due, turn, self.clone());
    }

    /// Takes the world away: it ticks no more. A run that is cut short streams a last observation that says why. Waits
    /// for a tick that is being made.
    pub(crate) fn take(&self, cut_short: Option<Reason>) -> Option<World> {
        lock(&self.inbox).turn += 1;
        let mut ticking = lock(&self.ticking);
        let mut world = ticking.world.take()?;
        if let Some(reason) = cut_short
            && let Ok(mut observation) = world.observe()
        {
            observation.truncated = true;
            observation.reason = Some(reason.as_str().into());
            // What the referee noted in this tick was told with it.
            observation.events.clear();
            let over = self.over();
            self.push(Streamed { observation, pictures: Pictures::default(), due: Instant::now() }, over);
        }
        Some(world)
    }

    /// How the run went.
    pub(crate) fn stats(&self) -> RealtimeStats {
        RealtimeStats { tempo: lock(&self.ticking).pace.tempo(), dropped: lock(&self.stream).dropped }
    }

    /// The world failed: the last observation is streamed once more and says so, or who follows the stream would wait for ever.
    fn fail(&self) {
        let over = Some(Reason::WorldFault);
        let last = lock(&self.stream).last.take();
        if let Some(last) = last {
            let reason = over.map(|reason| reason.as_str().into());
            let observation =
                Observation { truncated: true, reason, events: vec![], cameras: vec![], ..last };
            let streamed = Streamed { observation, pictures: Pictures::default(), due: Instant::now() };
            self.push(streamed, over);
        }
        lock(&self.stream).over = over;
        self.news.notify_one();
    }

    /// The action that makes the hand stay as it is.
    fn still(world: &mut World) -> Result<Action, StepError> {
        let seen = world.observe()?;
        let sigma = seen.hand.column("motors", "position");
        let base = palmares_tasks::BaseTarget::Twist { linear: [0.0; 3], angular: [0.0; 3] };
        Ok(Action { base: Some(base), hand: Some(sigma) })
    }
}

impl Paced for Live {
    fn official(&self) -> bool {
        self.official
    }

    fn tick(&self, turn: u64) -> Option<Instant> {
        let due = {
            let ticking = lock(&self.ticking);
            ticking.world.as_ref()?;
            ticking.pace.due()
        };
        let permit = self.scheduler.permit_blocking(Urgency::realtime(self.official, due));
        let mut ticking = lock(&self.ticking);
        let Ticking { world: Some(world), pace } = &mut *ticking else { return None };
        let (fresh, shots) = {
            let mut inbox = lock(&self.inbox);
            if inbox.turn != turn {
                return None;
            }
            inbox.tick += 1;
            (inbox.action.take(), std::mem::take(&mut inbox.shots))
        };
        let now = Instant::now();
        let (late, part) = pace.begin(now, fresh.is_some());
        self.scheduler.load().was_late(now, late);
        METRICS.began(late, part == Part::Fresh);
        world.begins(late);
        let action = match part {
            Part::Still => Self::still(world),
            Part::Fresh | Part::Repeat => Ok(fresh.unwrap_or_default()),
        };
        let ticked = action.and_then(|action| match world.tick(&action, &permit) {
            // It was looked at when it came; if it does not fit after all, the tick is made without it.
            Err(StepError::Action(error)) => {
                tracing::error!(%error, "an action that was taken does not fit");
                world.tick(&Action::default(), &permit)
            }
            done => done,
        });
        let seen = ticked.and_then(|over| Ok((over, world.observe()?, world.expose(&shots))));
        drop(permit);
        match seen {
            Ok((over, observation, pictures)) => {
                self.push(Streamed { observation, pictures, due }, over);
                world.tell();
                over.is_none().then(|| pace.due())
            }
            // The world knows what it failed of.
            Err(_) => {
                self.fail();
                None
            }
        }
    }
}

#[cfg(test)]
mod tests;
