//! A world: the one place in the server where a run is stepped. Whoever wants to see every tick, a recorder or
//! spectators, is a [`Witness`] of it.

use super::pictures::{self, Pictures};
use super::witness::Witness;
use crate::compute::admission::Admitted;
use crate::compute::background::{Background, JobError, Level, panic_text};
use crate::compute::scheduler::{Permit, Scheduler, Urgency};
use crate::metrics::METRICS;
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

/// What a world needs of a run. [`Run`] is the real one; tests bring worlds that break.
pub(crate) trait Playable: Send {
    fn step(&mut self, action: &Action) -> Result<(), ActionError>;
    /// Does what the next step does before its action matters.
    fn prepare(&mut self) {}
    fn observe(&self, sensing: Sensing) -> Observation;
    fn events(&self) -> &[Event];
    fn over(&self) -> Option<Reason>;
    /// When the world became unsound and of what, when it is.
    fn failure(&self) -> Option<Failure>;
    /// The failure of a program that fails now.
    fn crash(&self) -> Failure;
    fn finish(&mut self, reason: Reason) -> Outcome;
    /// For witnesses and for what only a real run can do.
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

/// After a step.
#[derive(Debug)]
pub(crate) struct Stepped {
    /// The state, with the events of all its ticks.
    pub(crate) observation: Observation,
    /// Why the run is over, when it is.
    pub(crate) over: Option<Reason>,
}

/// Why a step was not made.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StepError {
    /// The action was refused; nothing changed.
    #[error(transparent)]
    Action(#[from] ActionError),
    /// The world is unsound, now and from now on.
    #[error("{0}")]
    Failed(Failure),
}

/// Why a world could not be opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    /// The scene could not be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The job that builds the scene failed.
    #[error(transparent)]
    Job(#[from] JobError),
}

/// What a world is made from.
pub(crate) struct WorldSetup {
    /// Task.
    pub(crate) task: Arc<Task>,
    /// Hand.
    pub(crate) hand: Arc<Hand>,
    /// Seed.
    pub(crate) seed: Seed,
    /// How much the controller sees.
    pub(crate) sensing: Sensing,
    /// How good its sensors are.
    pub(crate) noise: Noise,
    /// Pictures of tick 0.
    pub(crate) shots: Vec<Shot>,
}

/// A world. Whoever owns it steps it.
pub(crate) struct World {
    /// Its failure after one.
    game: Result<Box<dyn Playable>, Failure>,
    sensing: Sensing,
    witnesses: Vec<Box<dyn Witness>>,
    /// Whether the witnesses have not been told of the last tick.
    untold: bool,
    /// What was computed between the last tick and the next took so long.
    between: Duration,
    /// Given back when the world is gone.
    admitted: Admitted,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let state = if self.game.is_ok() { "sound" } else { "failed" };
        write!(f, "World ({state}, {} witnesses)", self.witnesses.len())
    }
}

/// A world at tick 0.
pub(crate) struct OpenedWorld {
    /// It.
    pub(crate) world: World,
    /// What stands in it.
    pub(crate) scene: Scene,
    /// What the controller sees.
    pub(crate) observation: Observation,
}

impl World {
    /// Builds a world in the background. `witnesses` look on from tick 0; `admitted` is given back when the world is gone.
    pub(crate) async fn open(
        setup: WorldSetup,
        admitted: Admitted,
        background: &Background,
        mut witnesses: Vec<Box<dyn Witness>>,
    ) -> Result<OpenedWorld, OpenError> {
        let build = move || {
            let WorldSetup { task, hand, seed, sensing, noise, shots } = setup;
            let mut run = Run::new(task, hand, seed)?.with_noise(noise);
            let (scene, mut observation) = (run.scene().clone().redacted_for(sensing), run.observe(sensing));
            observation.cameras = pictures::drawn(&run.expose(&shots));
            witnesses.iter_mut().for_each(|witness| witness.opened(&run));
            let world = World::of(Box::new(run), sensing, witnesses, admitted);
            Ok(OpenedWorld { world, scene, observation })
        };
        background.run(Level::Awaited, build).await?
    }

    pub(crate) fn of(
        game: Box<dyn Playable>,
        sensing: Sensing,
        witnesses: Vec<Box<dyn Witness>>,
        admitted: Admitted,
    ) -> Self {
        World { game: Ok(game), sensing, witnesses, untold: false, between: Duration::ZERO, admitted }
    }

    /// Tells the witnesses of the last tick. The controller need not wait for it.
    pub(crate) fn tell(&mut self) {
        if std::mem::take(&mut self.untold) {
            self.meanwhile(|game, witnesses| {
                if let Some(run) = game.run() {
                    witnesses.iter_mut().for_each(|witness| witness.ticked(run));
                }
            });
        }
    }

    /// Does what the next tick does before its action matters. The witnesses have been told: they see a whole state.
    pub(crate) fn prepare(&mut self, _permit: &Permit) {
        self.meanwhile(|game, witnesses| {
            if let Some(run) = game.run() {
                witnesses.iter_mut().for_each(|witness| witness.rested(run));
            }
            game.prepare();
        });
    }

    /// What is computed between two ticks counts as part of the second.
    fn meanwhile(&mut self, work: impl FnOnce(&mut dyn Playable, &mut [Box<dyn Witness>])) {
        let (Ok(game), witnesses) = (self.game.as_mut(), &mut self.witnesses) else { return };
        let begun = Instant::now();
        let done = catch_unwind(AssertUnwindSafe(|| {
            work(game.as_mut(), witnesses);
            Ok(())
        }));
        self.between += begun.elapsed();
        // Of a failure the next tick tells.
        let _ = self.failure_ends_it(done);
    }

    /// Advances the world by up to `repeat` ticks; fewer when the run is over before.
    pub(crate) async fn step(
        &mut self,
        scheduler: &Scheduler,
        official: bool,
        action: &Action,
        repeat: u32,
    ) -> Result<Stepped, StepError> {
        let mut earlier = Vec::new();
        let mut left = repeat.max(1);
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
                return Ok(Stepped { observation, over });
            }
            drop(permit);
            // Another controller may be waiting for this very core to send its request, with other cores free to answer it.
            if self.admitted.has_company() {
                std::thread::yield_now();
            }
            if let Ok(game) = &self.game {
                earlier.extend(game.events().iter().map(|event| event.redacted_for(self.sensing)));
            }
        }
    }

    /// Advances the world by one tick and says whether the run is over. A refused action changes nothing; a fault
    /// is the world's end. Whoever calls this tells the witnesses once the controller has been answered.
    pub(crate) fn tick(&mut self, action: &Action, _permit: &Permit) -> Result<Option<Reason>, StepError> {
        self.tell();
        let between = std::mem::take(&mut self.between);
        let game = self.game.as_mut().map_err(|failure| StepError::Failed(*failure))?;
        let ticked = catch_unwind(AssertUnwindSafe(|| {
            let begun = Instant::now();
            game.step(action)?;
            if let Some(failure) = game.failure() {
                return Err(StepError::Failed(failure));
            }
            METRICS.ticked(between + begun.elapsed());
            Ok(game.over())
        }));
        self.untold = matches!(ticked, Ok(Ok(_)));
        self.failure_ends_it(ticked)
    }

    /// A tick that follows the clock begins so late.
    pub(crate) fn begins(&mut self, late: Duration) {
        self.witnesses.iter_mut().for_each(|witness| witness.began(late));
    }

    /// What the controller sees now.
    pub(crate) fn observe(&mut self) -> Result<Observation, StepError> {
        let game = self.game.as_ref().map_err(|failure| StepError::Failed(*failure))?;
        let seen = catch_unwind(AssertUnwindSafe(|| Ok(game.observe(self.sensing))));
        self.failure_ends_it(seen)
    }

    /// After a failure there is no world any more.
    fn failure_ends_it<T>(
        &mut self,
        done: std::thread::Result<Result<T, StepError>>,
    ) -> Result<T, StepError> {
        let done = done.unwrap_or_else(|panic| {
            tracing::error!(panic = panic_text(panic.as_ref()), "a world panicked");
            let crash = self.game.as_ref().map_or_else(|failure| *failure, |game| game.crash());
            Err(StepError::Failed(crash))
        });
        if let Err(StepError::Failed(failure)) = done {
            self.fail(failure);
        }
        done
    }

    /// The world is gone, and its witnesses are told.
    fn fail(&mut self, failure: Failure) {
        if std::mem::replace(&mut self.game, Err(failure)).is_err() {
            return;
        }
        let witnesses = &mut self.witnesses;
        // One of them may be what has panicked.
        let told = catch_unwind(AssertUnwindSafe(|| {
            witnesses.iter_mut().for_each(|witness| witness.failed(failure.fault));
        }));
        if let Err(panic) = told {
            tracing::error!(panic = panic_text(panic.as_ref()), "a witness panicked");
        }
    }

    /// Pushes the hand from the next tick on.
    pub(crate) fn push(&mut self, link: &str, wrench: Wrench, duration_s: f64) -> Result<(), PushError> {
        self.tell();
        let Some(run) = self.game.as_mut().ok().and_then(|game| game.run()) else { return Ok(()) };
        run.push(link, wrench, duration_s)?;
        self.witnesses.iter_mut().for_each(|witness| witness.pushed(link, wrench, duration_s));
        Ok(())
    }

    /// The number of the tick that comes next.
    pub(crate) fn next_tick(&mut self) -> u64 {
        self.game.as_mut().ok().and_then(|game| game.run()).map_or(1, |run| run.tick() + 1)
    }

    /// The pictures that a controller asks for by these words.
    ///
    /// # Errors
    /// One of them cannot be had.
    pub(crate) fn shots(&mut self, cameras: &[String]) -> Result<Vec<Shot>, ShotError> {
        match self.game.as_mut().ok().and_then(|game| game.run()) {
            Some(run) if !cameras.is_empty() => run.shots(cameras, self.sensing),
            _ => Ok(Vec::new()),
        }
    }

    /// Takes pictures, which are not drawn yet.
    pub(crate) fn expose(&mut self, shots: &[Shot]) -> Pictures {
        match self.game.as_mut().ok().and_then(|game| game.run()) {
            Some(run) if !shots.is_empty() => {
                Pictures { wanted: run.expose(shots), upcoming: run.upcoming(shots) }
            }
            _ => Pictures::default(),
        }
    }

    /// When the world failed and of what, when it has.
    pub(crate) fn failure(&self) -> Option<Failure> {
        self.game.as_ref().err().copied()
    }

    /// Lets the objects settle and counts, in the background.
    ///
    /// # Errors
    /// The world failed.
    pub(crate) async fn finish(
        mut self,
        background: &Background,
        reason: Reason,
    ) -> Result<Outcome, Failure> {
        let crash = self.game.as_ref().map_or_else(|failure| *failure, |game| game.crash());
        let settle = move || {
            self.tell();
            let game = self.game.as_mut().map_err(|failure| *failure)?;
            let outcome = game.finish(reason);
            if let Some(failure) = game.failure() {
                self.fail(failure);
                return Err(failure);
            }
            if let Some(run) = game.run() {
                self.witnesses.iter_mut().for_each(|witness| witness.finished(run, &outcome));
            }
            Ok(outcome)
        };
        background.run(Level::Awaited, settle).await.unwrap_or_else(|error| {
            tracing::error!(%error, "a run could not be counted");
            Err(crash)
        })
    }
}

#[cfg(test)]
mod tests;
