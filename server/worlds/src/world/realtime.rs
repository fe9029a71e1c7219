//! A realtime world: it ticks by the clock, whether or not its client acts, reads or is connected.
//!
//! The pacer steps it; the session's connection puts actions into its inbox and takes observations from its stream. Neither waits
//! for the other: when the stream is full, the oldest observation is dropped.

use super::backlog::Gate;
use super::images::StepImages;
use super::run::{StepError, World};
use crate::compute::Compute;
use crate::compute::pace::{ActionSource, Pace, Tempo};
use crate::compute::pacer::{Paced, Pacer};
use crate::compute::scheduler::{Scheduler, Urgency};
use crate::compute::tick_phase::TickPhase;
use palmares_metrics::METRICS;
use palmares_models::hand::Hand;
use palmares_tasks::run::{Shot, ShotError};
use palmares_tasks::{Action, ActionError, Observation, Reason};
use parking_lot::Mutex;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::Notify;

/// Longest queue of observations for a slow client.
pub const STREAM_LENGTH: usize = 32;

/// An observation on its way to the client.
#[derive(Debug)]
pub struct StreamedObservation {
    /// The observation, without images.
    pub observation: Observation,
    /// Its images.
    pub images: StepImages,
    /// When its tick was due.
    pub due: Instant,
}

/// Timing of a realtime run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RealtimeStats {
    /// Missed and late ticks.
    pub tempo: Tempo,
    /// Observations that were dropped for a slow client.
    pub dropped: u64,
}

/// The controller's next action, and which pacer entry may tick.
struct Inbox {
    action: Option<Action>,
    /// Camera images for the next observation.
    shots: Vec<Shot>,
    /// The tick that has taken its action last.
    tick: u64,
    /// Generation of the pacer entry; entries of older generations are ignored.
    generation: u64,
    paused: bool,
    /// When the session's time is spent: no tick begins then or later. None while its clock stands, or without a limit.
    ends: Option<Instant>,
}

struct Ticking {
    /// None after the run was closed.
    world: Option<World>,
    pace: Pace,
}

#[derive(Default)]
struct Stream {
    waiting: VecDeque<StreamedObservation>,
    /// The last observation, at first that of tick 0; a failed world ends with it.
    last: Option<Observation>,
    dropped: u64,
    over: Option<Reason>,
}

/// A realtime world.
pub struct RealtimeWorld {
    hand: Arc<Hand>,
    tick_phase: TickPhase,
    official: bool,
    /// Closed while too many ticks are not stored; None for a run that no other host can continue.
    gate: Option<Gate>,
    scheduler: Scheduler,
    inbox: Mutex<Inbox>,
    ticking: Mutex<Ticking>,
    stream: Mutex<Stream>,
    notify: Notify,
}

impl std::fmt::Debug for RealtimeWorld {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RealtimeWorld at tick {}", self.tick_now())
    }
}

impl RealtimeWorld {
    /// Starts a world.
    pub fn start(
        world: World,
        hand: Arc<Hand>,
        tick_s: f64,
        official: bool,
        gate: Option<Gate>,
        compute: &Compute,
    ) -> Arc<Self> {
        let live = Self::standing(world, hand, tick_s, official, gate, compute);
        live.resume(&compute.pacer);
        live
    }

    /// A world that stands until [`RealtimeWorld::resume`].
    pub fn standing(
        world: World,
        hand: Arc<Hand>,
        tick_s: f64,
        official: bool,
        gate: Option<Gate>,
        compute: &Compute,
    ) -> Arc<Self> {
        let tick_phase = compute.pacer.next_phase();
        let pace = Pace::new(tick_phase.not_before(Instant::now(), tick_s), tick_s);
        let scheduler = compute.scheduler.clone();
        let live = Arc::new(Self::new(world, hand, pace, tick_phase, official, gate, scheduler));
        live.pause();
        live
    }

    fn new(
        mut world: World,
        hand: Arc<Hand>,
        pace: Pace,
        tick_phase: TickPhase,
        official: bool,
        gate: Option<Gate>,
        scheduler: Scheduler,
    ) -> Self {
        let last = world.observe().ok();
        let tick = last.as_ref().map_or(0, |observation| observation.tick);
        RealtimeWorld {
            hand,
            tick_phase,
            official,
            gate,
            scheduler,
            inbox: Mutex::new(Inbox {
                action: None,
                shots: vec![],
                tick,
                generation: 0,
                paused: false,
                ends: None,
            }),
            ticking: Mutex::new(Ticking { world: Some(world), pace }),
            stream: Mutex::new(Stream { last, ..Stream::default() }),
            notify: Notify::new(),
        }
    }

    /// The camera images that a controller asks for by name.
    ///
    /// # Errors
    /// A name is unknown, or its image is not available.
    pub fn shots(&self, cameras: &[String]) -> Result<Vec<Shot>, ShotError> {
        match cameras.is_empty() {
            true => Ok(Vec::new()),
            false => self.with_world(|world| world.shots(cameras)).unwrap_or(Ok(Vec::new())),
        }
    }

    /// Takes an action and the images for the next observation; parts that it leaves out keep their values. Returns the tick at
    /// which it takes effect.
    pub fn act(&self, action: Action, shots: Vec<Shot>) -> Result<u64, ActionError> {
        action.check(&self.hand)?;
        let mut inbox = self.inbox.lock();
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
        if action.effort.is_some() {
            next.effort = action.effort;
        }
        Ok(inbox.tick + 1)
    }

    /// The session's time is spent at this moment: from then on the world stands until its run is closed or the session has more time.
    pub fn end_at(&self, ends: Option<Instant>) {
        self.inbox.lock().ends = ends;
    }

    /// Calls `work` with the world, between two ticks. None after the run was closed.
    pub fn with_world<T>(&self, work: impl FnOnce(&mut World) -> T) -> Option<T> {
        self.ticking.lock().world.as_mut().map(work)
    }

    /// The current tick.
    pub fn tick_now(&self) -> u64 {
        self.inbox.lock().tick
    }

    /// Returns when an observation is in the stream, or the run is over.
    pub async fn changed(&self) {
        self.notify.notified().await;
    }

    /// Takes the oldest observation from the stream.
    pub fn pop(&self) -> Option<StreamedObservation> {
        self.stream.lock().waiting.pop_front()
    }

    /// Tick of the oldest observation in the stream.
    pub fn oldest_waiting(&self) -> Option<u64> {
        self.stream.lock().waiting.front().map(|waiting| waiting.observation.tick)
    }

    /// Makes [`RealtimeWorld::changed`] return again if the stream is not empty.
    pub fn renotify(&self) {
        if !self.stream.lock().waiting.is_empty() {
            self.notify.notify_one();
        }
    }

    /// Drops all observations in the stream but the last, for a client that reconnects.
    pub fn keep_last(&self) {
        let mut stream = self.stream.lock();
        let old = stream.waiting.len().saturating_sub(1);
        stream.waiting.drain(..old);
        drop(stream);
        self.notify.notify_one();
    }

    /// Reason why the run is over, if it is; then it ticks no more.
    pub fn over(&self) -> Option<Reason> {
        self.stream.lock().over
    }

    fn push(&self, streamed: StreamedObservation, over: Option<Reason>) {
        let mut stream = self.stream.lock();
        if stream.waiting.len() >= STREAM_LENGTH {
            stream.waiting.pop_front();
            stream.dropped += 1;
        }
        stream.last = Some(streamed.observation.clone());
        stream.waiting.push_back(streamed);
        stream.over = over;
        drop(stream);
        self.notify.notify_one();
    }

    /// Stops the world until [`RealtimeWorld::resume`].
    pub fn pause(&self) {
        let mut inbox = self.inbox.lock();
        inbox.paused = true;
        inbox.generation += 1;
    }

    /// Continues the world; the pause does not count. Blocks until a tick in progress has ended.
    pub fn resume(self: &Arc<Self>, pacer: &Pacer) {
        let mut ticking = self.ticking.lock();
        let mut inbox = self.inbox.lock();
        if !inbox.paused || ticking.world.is_none() {
            return;
        }
        inbox.paused = false;
        let origin = self.tick_phase.not_before(Instant::now(), ticking.pace.tick_s());
        ticking.pace.restart(origin);
        let (due, generation) = (ticking.pace.due(), inbox.generation);
        drop((ticking, inbox));
        pacer.enlist(due, generation, self.clone());
    }

    /// Takes the world: it ticks no more. A run that is cut short streams a last observation with the reason. Blocks until a tick
    /// in progress has ended.
    pub fn take(&self, cut_short: Option<Reason>) -> Option<World> {
        self.inbox.lock().generation += 1;
        let mut ticking = self.ticking.lock();
        let mut world = ticking.world.take()?;
        if let Some(reason) = cut_short
            && let Ok(mut observation) = world.observe()
        {
            observation.truncated = true;
            observation.reason = Some(reason.as_str().into());
            // The events of this tick were streamed with it.
            observation.events.clear();
            let over = self.over();
            self.push(
                StreamedObservation { observation, images: StepImages::default(), due: Instant::now() },
                over,
            );
        }
        Some(world)
    }

    /// The run's timing.
    pub fn stats(&self) -> RealtimeStats {
        RealtimeStats { tempo: self.ticking.lock().pace.tempo(), dropped: self.stream.lock().dropped }
    }

    /// The world failed: streams the last observation again with the reason, or readers of the stream would wait forever.
    fn fail(&self) {
        let over = Some(Reason::WorldFault);
        let last = self.stream.lock().last.take();
        if let Some(last) = last {
            let reason = over.map(|reason| reason.as_str().into());
            let observation =
                Observation { truncated: true, reason, events: vec![], cameras: vec![], ..last };
            let streamed =
                StreamedObservation { observation, images: StepImages::default(), due: Instant::now() };
            self.push(streamed, over);
        }
        self.stream.lock().over = over;
        self.notify.notify_one();
    }

    /// Whether the next tick may begin. While the gate is closed the world stands as in a pause: `Err` has when to try again, or
    /// None if the session has another owner.
    fn pass_gate(&self, pace: &mut Pace) -> Result<(), Option<Instant>> {
        let Some(gate) = &self.gate else { return Ok(()) };
        if gate.is_lost() {
            return Err(None);
        }
        if gate.may_show(self.tick_now() + 1) {
            return Ok(());
        }
        gate.add_stood(pace.postpone(Instant::now()));
        Err(Some(pace.due()))
    }

    /// The action that holds the hand where it is.
    fn hold(world: &mut World) -> Result<Action, StepError> {
        let observation = world.observe()?;
        let sigma = observation.hand.column("motors", "position");
        let base = palmares_tasks::BaseTarget::Twist { linear: [0.0; 3], angular: [0.0; 3] };
        Ok(Action { base: Some(base), hand: Some(sigma), effort: None })
    }
}

impl Paced for RealtimeWorld {
    fn official(&self) -> bool {
        self.official
    }

    fn tick(&self, generation: u64) -> Option<Instant> {
        let due = {
            let mut ticking = self.ticking.lock();
            ticking.world.as_ref()?;
            if self.inbox.lock().generation != generation {
                return None;
            }
            if let Err(later) = self.pass_gate(&mut ticking.pace) {
                return later;
            }
            ticking.pace.due()
        };
        let permit = self.scheduler.permit_blocking(Urgency::realtime(self.official, due));
        let mut ticking = self.ticking.lock();
        let Ticking { world: Some(world), pace } = &mut *ticking else { return None };
        let now = Instant::now();
        let (fresh, shots) = {
            let mut inbox = self.inbox.lock();
            if inbox.generation != generation {
                return None;
            }
            if inbox.ends.is_some_and(|ends| now >= ends) {
                pace.postpone(now);
                return Some(pace.due());
            }
            inbox.tick += 1;
            (inbox.action.take(), std::mem::take(&mut inbox.shots))
        };
        let (late, source) = pace.begin(now, fresh.is_some());
        self.scheduler.load().was_late(now, late);
        METRICS.began(late, source == ActionSource::Fresh);
        world.report_lateness(late);
        let action = match source {
            ActionSource::Hold => Self::hold(world),
            ActionSource::Fresh | ActionSource::Repeat => Ok(fresh.unwrap_or_default()),
        };
        let ticked = action.and_then(|action| match world.tick(&action, &permit) {
            // The action was checked when it came. If it does not fit after all, the tick is made without it.
            Err(StepError::Action(error)) => {
                tracing::error!(%error, "an accepted action does not fit");
                world.tick(&Action::default(), &permit)
            }
            done => done,
        });
        let observed = ticked.and_then(|over| Ok((over, world.observe()?, world.expose(&shots))));
        drop(permit);
        match observed {
            Ok((over, observation, images)) => {
                self.push(StreamedObservation { observation, images, due }, over);
                world.notify_observers();
                over.is_none().then(|| pace.due())
            }
            // The world keeps its failure.
            Err(_) => {
                self.fail();
                None
            }
        }
    }
}

#[cfg(test)]
mod tests;
