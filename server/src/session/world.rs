//! A world on a thread of its own, reached through a bounded channel.

use palmares_models::hand::Hand;
use palmares_tasks::SceneError;
use palmares_tasks::{Action, ActionError, Observation, Outcome, Reason, Run, Scene, Seed, Sensing, Task};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, mpsc, oneshot};

/// Bytes of stack of a world's thread.
const STACK: usize = 8 << 20;

/// What is asked of the world's thread. Each asker waits for its answer, so one place in the channel is enough.
enum Command {
    Step { action: Action, repeat: u32, reply: oneshot::Sender<Result<Stepped, StepError>> },
    Finish { reason: Reason, reply: oneshot::Sender<Outcome> },
}

/// The world as the thread sees it. [`Run`] is the real one; tests bring worlds that break.
trait Playable {
    fn step(&mut self, action: &Action) -> Result<(), ActionError>;
    fn observe(&self, sensing: Sensing) -> Observation;
    fn healthy(&self) -> bool;
    fn finish(&mut self, reason: Reason) -> Outcome;
}

impl Playable for Run {
    fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        Run::step(self, action)
    }
    fn observe(&self, sensing: Sensing) -> Observation {
        Run::observe(self, sensing)
    }
    fn healthy(&self) -> bool {
        Run::healthy(self)
    }
    fn finish(&mut self, reason: Reason) -> Outcome {
        Run::finish(self, reason)
    }
}

/// After a step.
#[derive(Debug)]
pub(crate) struct Stepped {
    /// The state, with the events of all its ticks.
    pub(crate) observation: Observation,
}

/// Why a step was not made.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StepError {
    /// The action was refused; nothing changed.
    #[error(transparent)]
    Action(#[from] ActionError),
    /// The world is unsound or its thread is gone.
    #[error("the world failed")]
    Fault,
}

/// Why a world could not be opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    /// The scene could not be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The thread could not be started.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// The thread panicked while it built the scene.
    #[error("the world failed while its scene was built")]
    Fault,
}

/// What a world is made from.
pub(crate) struct Plan {
    /// Identifies the run; names the thread.
    pub(crate) run_id: String,
    /// Task.
    pub(crate) task: Arc<Task>,
    /// Hand.
    pub(crate) hand: Arc<Hand>,
    /// Seed.
    pub(crate) seed: Seed,
    /// How much the controller sees.
    pub(crate) sensing: Sensing,
}

/// The way to a world's thread. Dropping it ends the thread.
#[derive(Debug)]
pub(crate) struct World {
    commands: mpsc::Sender<Command>,
}

/// A world at tick 0.
pub(crate) struct OpenedWorld {
    /// The way to it.
    pub(crate) world: World,
    /// What stands in it.
    pub(crate) scene: Scene,
    /// What the controller sees.
    pub(crate) observation: Observation,
}

impl World {
    /// Builds a world on a new thread. `permit` is given back when the thread ends.
    pub(crate) async fn open(plan: Plan, permit: OwnedSemaphorePermit) -> Result<OpenedWorld, OpenError> {
        let Plan { run_id, task, hand, seed, sensing } = plan;
        let build = move || {
            let run = Run::new(task, hand, seed)?;
            let scene = run.scene().clone();
            Ok((run, scene))
        };
        Self::open_with(run_id, sensing, permit, build).await
    }

    async fn open_with<P: Playable>(
        run_id: String,
        sensing: Sensing,
        permit: OwnedSemaphorePermit,
        build: impl FnOnce() -> Result<(P, Scene), SceneError> + Send + 'static,
    ) -> Result<OpenedWorld, OpenError> {
        let (commands, inbox) = mpsc::channel(1);
        let (ready, built) = oneshot::channel();
        let body = move || {
            let _permit = permit;
            let life = AssertUnwindSafe(|| live(build, sensing, ready, inbox));
            if let Err(panic) = catch_unwind(life) {
                tracing::error!(run_id, panic = panic_text(panic.as_ref()), "world thread panicked");
            }
        };
        std::thread::Builder::new().name("world".into()).stack_size(STACK).spawn(body)?;
        let (scene, observation) = built.await.map_err(|_| OpenError::Fault)??;
        Ok(OpenedWorld { world: World { commands }, scene, observation })
    }

    /// Advances the world by up to `repeat` ticks; fewer when the run is over before.
    pub(crate) async fn step(&self, action: Action, repeat: u32) -> Result<Stepped, StepError> {
        let (reply, answer) = oneshot::channel();
        let sent = self.commands.send(Command::Step { action, repeat, reply }).await;
        sent.map_err(|_| StepError::Fault)?;
        answer.await.map_err(|_| StepError::Fault)?
    }

    /// Lets the objects settle and counts. None when the world failed.
    pub(crate) async fn finish(self, reason: Reason) -> Option<Outcome> {
        let (reply, answer) = oneshot::channel();
        self.commands.send(Command::Finish { reason, reply }).await.ok()?;
        answer.await.ok()
    }
}

type Built = Result<(Scene, Observation), SceneError>;

/// The life of a world's thread.
fn live<P: Playable>(
    build: impl FnOnce() -> Result<(P, Scene), SceneError>,
    sensing: Sensing,
    ready: oneshot::Sender<Built>,
    mut inbox: mpsc::Receiver<Command>,
) {
    let mut world = match build() {
        Ok((world, scene)) => {
            if ready.send(Ok((scene, world.observe(sensing)))).is_err() {
                return;
            }
            world
        }
        Err(error) => {
            // Whoever asked may be gone; then nobody wants to know.
            let _ = ready.send(Err(error));
            return;
        }
    };
    while let Some(command) = inbox.blocking_recv() {
        match command {
            Command::Step { action, repeat, reply } => {
                let result = advance(&mut world, &action, repeat, sensing);
                let fault = matches!(result, Err(StepError::Fault));
                let _ = reply.send(result);
                if fault {
                    return;
                }
            }
            Command::Finish { reason, reply } => {
                let _ = reply.send(world.finish(reason));
                return;
            }
        }
    }
}

fn advance<P: Playable>(
    world: &mut P,
    action: &Action,
    repeat: u32,
    sensing: Sensing,
) -> Result<Stepped, StepError> {
    let mut events = Vec::new();
    for left in (0..repeat).rev() {
        world.step(action)?;
        if !world.healthy() {
            return Err(StepError::Fault);
        }
        // In between only the events and the end matter; the cheaper view has both.
        let observation = world.observe(if left == 0 { sensing } else { Sensing::Sensors });
        if left == 0 {
            events.extend_from_slice(&observation.events);
            return Ok(Stepped { observation: Observation { events, ..observation } });
        }
        events.extend(observation.events);
        if observation.terminated || observation.truncated {
            return Ok(Stepped { observation: Observation { events, ..world.observe(sensing) } });
        }
    }
    // Only for a repeat of 0, which nobody may ask for.
    Ok(Stepped { observation: world.observe(sensing) })
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_tasks::observation::{BodyState, Event, HandObservation, Wrench};
    use tokio::sync::Semaphore;

    /// Counts ticks; ends, breaks or panics when told.
    struct Toy {
        tick: u64,
        over_at: u64,
        unsound_at: u64,
        panic_at: u64,
    }

    impl Default for Toy {
        fn default() -> Self {
            Toy { tick: 0, over_at: u64::MAX, unsound_at: u64::MAX, panic_at: u64::MAX }
        }
    }

    impl Playable for Toy {
        fn step(&mut self, action: &Action) -> Result<(), ActionError> {
            if action.hand.is_some() {
                return Err(ActionError::ZeroQuaternion);
            }
            self.tick += 1;
            assert!(self.tick != self.panic_at, "toy panic");
            Ok(())
        }
        fn observe(&self, _: Sensing) -> Observation {
            let (position, linear) = ([0.0; 3], [0.0; 3]);
            let base = BodyState { position, quat_xyzw: [0.0, 0.0, 0.0, 1.0], linear, angular: linear };
            Observation {
                tick: self.tick,
                sim_time_s: 0.0,
                applied_action: Action::default(),
                hand: HandObservation {
                    base,
                    actuators: vec![],
                    wrist: Wrench { force: [0.0; 3], torque: [0.0; 3] },
                },
                truth: None,
                events: vec![Event { tick: self.tick, kind: "tick".into(), object: None }],
                score: 0.0,
                terminated: false,
                truncated: self.tick >= self.over_at,
                reason: None,
            }
        }
        fn healthy(&self) -> bool {
            self.tick < self.unsound_at
        }
        fn finish(&mut self, reason: Reason) -> Outcome {
            Outcome {
                score: self.tick as f64,
                in_goal: 0,
                outside: 0,
                reason,
                ticks: self.tick,
                sim_time_s: 0.0,
                events: vec![],
                state_hash: String::new(),
            }
        }
    }

    async fn open(toy: Toy) -> (World, Arc<Semaphore>) {
        let places = Arc::new(Semaphore::new(1));
        let permit = places.clone().acquire_owned().await.expect("open");
        let scene = Scene { bodies: vec![], regions: vec![], gravity: [0.0; 3] };
        let opened = World::open_with("r".into(), Sensing::Truth, permit, move || Ok((toy, scene))).await;
        (opened.map(|opened| opened.world).expect("opens"), places)
    }

    #[tokio::test]
    async fn repeated_ticks_keep_all_events_and_end_with_the_run() {
        let (world, _) = open(Toy { over_at: 5, ..Toy::default() }).await;
        let three = world.step(Action::default(), 3).await.expect("steps").observation;
        assert_eq!(three.events.iter().map(|event| event.tick).collect::<Vec<_>>(), [1, 2, 3]);
        let rest = world.step(Action::default(), 9).await.expect("steps").observation;
        assert_eq!((rest.tick, rest.events.len()), (5, 2));
        assert_eq!(world.finish(Reason::Stopped).await.map(|outcome| outcome.ticks), Some(5));
    }

    #[tokio::test]
    async fn a_refused_action_changes_nothing() {
        let (world, _) = open(Toy::default()).await;
        let wrong = Action { hand: Some(vec![]), base: None };
        assert!(matches!(world.step(wrong, 1).await, Err(StepError::Action(_))));
        assert_eq!(world.step(Action::default(), 1).await.expect("steps").observation.tick, 1);
    }

    #[tokio::test]
    async fn an_unsound_or_panicking_world_is_a_fault_and_frees_its_place() {
        for toy in [Toy { unsound_at: 2, ..Toy::default() }, Toy { panic_at: 2, ..Toy::default() }] {
            let (world, places) = open(toy).await;
            assert!(world.step(Action::default(), 1).await.is_ok());
            assert!(matches!(world.step(Action::default(), 1).await, Err(StepError::Fault)));
            assert!(matches!(world.step(Action::default(), 1).await, Err(StepError::Fault)));
            assert!(world.finish(Reason::Stopped).await.is_none());
            assert!(places.acquire().await.is_ok());
        }
    }
}
