//! A world: the only place in the server where a run is stepped. A recorder and the spectators' hub see every tick as its
//! [`RunObserver`]s.

use super::images::{self, StepImages};
use super::run_observer::{RunObserver, Ticked};
use crate::compute::admission::Admitted;
use crate::compute::background::{Background, JobError, JobPriority, panic_text};
use crate::compute::scheduler::{Permit, Scheduler, Urgency};
use palmares_metrics::METRICS;
use palmares_models::hand::Hand;
use palmares_tasks::observation::Wrench;
use palmares_tasks::run::{Failure, PushError, Shot, ShotError};
use palmares_tasks::{
    Action, ActionError, Event, Fault, Noise, Observation, Outcome, Reason, Run, Scene, SceneError, Seed,
    Sensing, Task,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The part of a run that a world uses. [`Run`] implements it; tests use stubs that break.
pub trait Playable: Send {
    /// One tick with this action.
    fn step(&mut self, action: &Action) -> Result<(), ActionError>;
    /// Computes the part of the next step that does not depend on its action.
    fn prepare(&mut self) {}
    /// What its client may know of its state.
    fn observe(&self, sensing: Sensing) -> Observation;
    /// The events of the last tick.
    fn events(&self) -> &[Event];
    /// Why it has ended, if it has.
    fn over(&self) -> Option<Reason>;
    /// When and why the world failed, if it has.
    fn failure(&self) -> Option<Failure>;
    /// The failure for a panic at this tick.
    fn crash(&self) -> Failure;
    /// Its result, if it ends now for this reason.
    fn finish(&mut self, reason: Reason) -> Outcome;
    /// The real run, for observers, pushes and cameras.
    fn run(&mut self) -> Option<&mut Run>;
}

impl Playable for Run {
    fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        Run::step(self, action)
    }
    fn prepare(&mut self) {
        Run::prepare(self);
    }
    fn observe(&self, sensing: Sensing) -> Observation {
        Run::observe(self, sensing)
    }
    fn events(&self) -> &[Event] {
        Run::events(self)
    }
    fn over(&self) -> Option<Reason> {
        Run::over(self)
    }
    fn failure(&self) -> Option<Failure> {
        Run::failure(self)
    }
    fn crash(&self) -> Failure {
        Failure { fault: Fault::Crashed, tick: self.tick(), step: Some(self.steps()) }
    }
    fn finish(&mut self, reason: Reason) -> Outcome {
        Run::finish(self, reason)
    }
    fn run(&mut self) -> Option<&mut Run> {
        Some(self)
    }
}

/// The ticks that a step still needs. Some can be in the world already, when another host has made them.
#[derive(Clone, Copy, Debug)]
pub struct Missing {
    /// Their number; 0 leaves only the observation.
    pub ticks: u32,
    /// The tick before the whole step. Its events are those after this tick.
    pub since: u64,
}

/// The result of a step.
#[derive(Debug)]
pub struct StepResult {
    /// The observation, with the events of all its ticks.
    pub observation: Observation,
    /// Reason why the run is over, if it is.
    pub over: Option<Reason>,
}

/// Reason why a step failed.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The action was refused; nothing changed.
    #[error(transparent)]
    Action(#[from] ActionError),
    /// The world has failed, for good.
    #[error("{0}")]
    Failed(Failure),
}

/// Reason why a world could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The scene could not be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The job that builds the scene failed.
    #[error(transparent)]
    Job(#[from] JobError),
}

/// The inputs of a world.
pub struct WorldSetup {
    /// Task.
    pub task: Arc<Task>,
    /// Hand.
    pub hand: Arc<Hand>,
    /// Seed.
    pub seed: Seed,
    /// Sensors only, or also the true state.
    pub sensing: Sensing,
    /// Noise of the sensors.
    pub noise: Noise,
    /// Camera images of tick 0.
    pub shots: Vec<Shot>,
}

/// A world. Its owner steps it.
pub struct World {
    /// The run, or its failure.
    run: Result<Box<dyn Playable>, Failure>,
    sensing: Sensing,
    observers: Vec<Box<dyn RunObserver>>,
    /// Whether the observers have not got the last tick yet.
    unreported: bool,
    /// Computing time between the last tick and the next.
    between: Duration,
    /// The world's place; freed when the world is dropped.
    admitted: Admitted,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let state = if self.run.is_ok() { "sound" } else { "failed" };
        write!(f, "World ({state}, {} observers)", self.observers.len())
    }
}

/// A world that was opened.
pub struct OpenedWorld {
    /// The world.
    pub world: World,
    /// The scene, as the controller may know it.
    pub scene: Scene,
    /// Its present observation.
    pub observation: Observation,
}

impl World {
    /// Builds a world in the background. `observers` see it from tick 0; `admitted` is freed when the world is dropped.
    pub async fn open(
        setup: WorldSetup,
        admitted: Admitted,
        background: &Background,
        observers: Vec<Box<dyn RunObserver>>,
    ) -> Result<OpenedWorld, OpenError> {
        let build = move || {
            let WorldSetup { task, hand, seed, sensing, noise, shots } = setup;
            let mut run = Run::new(task, hand, seed)?.with_noise(noise);
            let cameras = images::render_here(&run.expose(&shots));
            let mut opened = World::of_run(run, sensing, observers, admitted);
            opened.observation.cameras = cameras;
            Ok(opened)
        };
        background.run(JobPriority::Awaited, build).await?
    }

    /// The world of a run at any tick; `observers` see it from there.
    pub fn of_run(
        run: Run,
        sensing: Sensing,
        mut observers: Vec<Box<dyn RunObserver>>,
        admitted: Admitted,
    ) -> OpenedWorld {
        let (scene, observation) = (run.scene().clone().redacted_for(sensing), run.observe(sensing));
        observers.iter_mut().for_each(|observer| observer.opened(&run));
        let world = World::of(Box::new(run), sensing, observers, admitted);
        OpenedWorld { world, scene, observation }
    }

    /// A world of this run, with a place that was admitted.
    pub fn of(
        playable: Box<dyn Playable>,
        sensing: Sensing,
        observers: Vec<Box<dyn RunObserver>>,
        admitted: Admitted,
    ) -> Self {
        World { run: Ok(playable), sensing, observers, unreported: false, between: Duration::ZERO, admitted }
    }

    /// Reports the last tick to the observers, after the controller has its reply.
    pub fn notify_observers(&mut self) {
        if std::mem::take(&mut self.unreported) {
            self.between_ticks(|playable, observers| {
                if let Some(run) = playable.run() {
                    let tick = Ticked::of(run);
                    observers.iter_mut().for_each(|observer| observer.ticked(&tick));
                }
            });
        }
    }

    /// Computes the part of the next tick that does not depend on its action. Before that, the observers see the complete state.
    pub fn prepare(&mut self, _permit: &Permit) {
        self.between_ticks(|playable, observers| {
            if let Some(run) = playable.run() {
                observers.iter_mut().for_each(|observer| observer.rested(run));
            }
            playable.prepare();
        });
    }

    /// Computes between two ticks; the time counts as part of the second.
    fn between_ticks(&mut self, work: impl FnOnce(&mut dyn Playable, &mut [Box<dyn RunObserver>])) {
        let (Ok(playable), observers) = (self.run.as_mut(), &mut self.observers) else { return };
        let begun = Instant::now();
        let done = catch_unwind(AssertUnwindSafe(|| {
            work(playable.as_mut(), observers);
            Ok(())
        }));
        self.between += begun.elapsed();
        // The next tick reports the failure.
        let _ = self.end_on_failure(done);
    }

    /// Advances the world by the missing ticks of a step, or fewer when the run is over before.
    pub async fn step(
        &mut self,
        scheduler: &Scheduler,
        official: bool,
        action: &Action,
        Missing { ticks, since }: Missing,
    ) -> Result<StepResult, StepError> {
        self.admitted.used();
        let mut earlier = self.events_since(since);
        let mut left = ticks;
        if left == 0 {
            let over = self.run.as_ref().ok().and_then(|playable| playable.over());
            return Ok(StepResult { observation: Observation { events: earlier, ..self.observe()? }, over });
        }
        loop {
            let permit = scheduler.permit(Urgency::lockstep(official, Instant::now())).await;
            let over = self.tick(action, &permit)?;
            left -= 1;
            if left == 0 || over.is_some() {
                let mut observation = self.observe()?;
                if !earlier.is_empty() {
                    earlier.append(&mut observation.events);
                    observation.events = earlier;
                }
                return Ok(StepResult { observation, over });
            }
            drop(permit);
            // A controller of another world may need this core to send its request.
            if self.admitted.has_others() {
                std::thread::yield_now();
            }
            if let Ok(playable) = &self.run {
                earlier.extend(playable.events().iter().map(|event| event.redacted_for(self.sensing)));
            }
        }
    }

    /// The events after a tick, up to now.
    fn events_since(&mut self, tick: u64) -> Vec<Event> {
        let sensing = self.sensing;
        let Some(run) = self.run.as_mut().ok().and_then(|playable| playable.run()) else { return Vec::new() };
        run.events_since(tick).map(|event| event.redacted_for(sensing)).collect()
    }

    /// Advances the world by one tick; returns why the run is over, if it is. A refused action changes nothing; a failure ends the
    /// world. The caller notifies the observers after the controller has its reply.
    pub fn tick(&mut self, action: &Action, _permit: &Permit) -> Result<Option<Reason>, StepError> {
        self.notify_observers();
        let between = std::mem::take(&mut self.between);
        let playable = self.run.as_mut().map_err(|failure| StepError::Failed(*failure))?;
        let ticked = catch_unwind(AssertUnwindSafe(|| {
            let begun = Instant::now();
            playable.step(action)?;
            if let Some(failure) = playable.failure() {
                return Err(StepError::Failed(failure));
            }
            METRICS.ticked(between + begun.elapsed());
            Ok(playable.over())
        }));
        self.unreported = matches!(ticked, Ok(Ok(_)));
        self.end_on_failure(ticked)
    }

    /// Reports the delay of a realtime tick to the observers.
    pub fn report_lateness(&mut self, late: Duration) {
        self.observers.iter_mut().for_each(|observer| observer.began(late));
    }

    /// The controller's observation.
    pub fn observe(&mut self) -> Result<Observation, StepError> {
        let playable = self.run.as_ref().map_err(|failure| StepError::Failed(*failure))?;
        let observed = catch_unwind(AssertUnwindSafe(|| Ok(playable.observe(self.sensing))));
        self.end_on_failure(observed)
    }

    /// Ends the world after a failure or a panic.
    fn end_on_failure<T>(&mut self, done: std::thread::Result<Result<T, StepError>>) -> Result<T, StepError> {
        let done = done.unwrap_or_else(|panic| {
            tracing::error!(panic = panic_text(panic.as_ref()), "a world panicked");
            let crash = self.run.as_ref().map_or_else(|failure| *failure, |playable| playable.crash());
            Err(StepError::Failed(crash))
        });
        if let Err(StepError::Failed(failure)) = done {
            self.fail(failure);
        }
        done
    }

    /// Drops the run and reports the failure to the observers.
    fn fail(&mut self, failure: Failure) {
        if std::mem::replace(&mut self.run, Err(failure)).is_err() {
            return;
        }
        let observers = &mut self.observers;
        // An observer may be the cause of the panic.
        let notified = catch_unwind(AssertUnwindSafe(|| {
            observers.iter_mut().for_each(|observer| observer.failed(failure.fault));
        }));
        if let Err(panic) = notified {
            tracing::error!(panic = panic_text(panic.as_ref()), "an observer panicked");
        }
    }

    /// Pushes the hand from the next tick on.
    pub fn push(&mut self, link: &str, wrench: Wrench, duration_s: f64) -> Result<(), PushError> {
        self.notify_observers();
        let Some(run) = self.run.as_mut().ok().and_then(|playable| playable.run()) else { return Ok(()) };
        run.push(link, wrench, duration_s)?;
        self.observers.iter_mut().for_each(|observer| observer.pushed(link, wrench, duration_s));
        Ok(())
    }

    /// The number of the tick that comes next.
    pub fn next_tick(&mut self) -> u64 {
        self.run.as_mut().ok().and_then(|playable| playable.run()).map_or(1, |run| run.tick() + 1)
    }

    /// The camera images that a controller asks for by name.
    ///
    /// # Errors
    /// A name is unknown, or its image is not available.
    pub fn shots(&mut self, cameras: &[String]) -> Result<Vec<Shot>, ShotError> {
        match self.run.as_mut().ok().and_then(|playable| playable.run()) {
            Some(run) if !cameras.is_empty() => run.shots(cameras, self.sensing),
            _ => Ok(Vec::new()),
        }
    }

    /// Exposes the cameras; the images are rendered later.
    pub fn expose(&mut self, shots: &[Shot]) -> StepImages {
        match self.run.as_mut().ok().and_then(|playable| playable.run()) {
            Some(run) if !shots.is_empty() => {
                StepImages { requested: run.expose(shots), upcoming: run.upcoming(shots) }
            }
            _ => StepImages::default(),
        }
    }

    /// When and why the world failed, if it has.
    pub fn failure(&self) -> Option<Failure> {
        self.run.as_ref().err().copied()
    }

    /// Lets the objects settle and scores the run, in the background.
    ///
    /// # Errors
    /// The world failed.
    pub async fn finish(mut self, background: &Background, reason: Reason) -> Result<Outcome, Failure> {
        let crash = self.run.as_ref().map_or_else(|failure| *failure, |playable| playable.crash());
        let settle = move || {
            self.notify_observers();
            let playable = self.run.as_mut().map_err(|failure| *failure)?;
            let outcome = playable.finish(reason);
            if let Some(failure) = playable.failure() {
                self.fail(failure);
                return Err(failure);
            }
            if let Some(run) = playable.run() {
                self.observers.iter_mut().for_each(|observer| observer.finished(run, &outcome));
            }
            Ok(outcome)
        };
        background.run(JobPriority::Awaited, settle).await.unwrap_or_else(|error| {
            tracing::error!(%error, "a run could not be scored");
            Err(crash)
        })
    }
}

#[cfg(test)]
mod tests;
