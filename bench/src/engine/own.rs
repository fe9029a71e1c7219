//! Palmares' own world with a clock.

use super::clock;
use super::interface::{Cost, Engine, EngineFactory};
use anyhow::Result;
use cpu_time::ThreadTime;
use palmares_models::Vec3;
use palmares_sim::{Command, Model, State, World};
use palmares_sim::{PhaseTimer, StepOutcome, StepPhase};
use std::hint::black_box;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Our engine. It has one set of settings, the constants of `sim/src/config.rs`.
#[derive(Debug)]
pub struct OwnFactory;

impl EngineFactory for OwnFactory {
    fn name(&self) -> &'static str {
        "own"
    }

    fn settings(&self) -> &'static str {
        "default"
    }

    fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        Ok(Box::new(Own::new(World::new(model, state))))
    }
}

/// Reading a thread's CPU time is a system call; it is made once a step. The phases are timed with the cheap
/// wall clock, and only their ratios are used.
struct Own {
    world: World,
    overhead: Duration,
}

static OVERHEAD: OnceLock<Duration> = OnceLock::new();

impl Own {
    fn new(world: World) -> Self {
        let overhead = clock::overhead(&OVERHEAD, || {
            let start = ThreadTime::now();
            let mut phases = Phases::new();
            for phase in [StepPhase::Dynamics, StepPhase::Collision, StepPhase::Solver] {
                phases.ended(phase);
            }
            black_box(phases.spent_s);
            start.elapsed()
        });
        Own { world, overhead }
    }
}

struct Phases {
    mark: Instant,
    /// Of each phase, in the order of [`StepPhase`].
    spent_s: [f64; 3],
}

impl Phases {
    fn new() -> Self {
        Phases { mark: Instant::now(), spent_s: [0.0; 3] }
    }
}

impl PhaseTimer for Phases {
    fn ended(&mut self, phase: StepPhase) {
        let now = Instant::now();
        self.spent_s[phase as usize] += now.duration_since(self.mark).as_secs_f64();
        self.mark = now;
    }
}

impl Engine for Own {
    fn model(&self) -> &Arc<Model> {
        self.world.model()
    }

    fn step(&mut self, command: &Command) -> Result<Cost> {
        let start = ThreadTime::now();
        let mut phases = Phases::new();
        self.world.step_timed(command, &mut phases);
        let total_s = clock::spent_s(start, self.overhead);
        Ok(Cost { total_s, phases_s: phases.spent_s })
    }

    fn state(&self) -> &State {
        self.world.state()
    }

    fn state_mut(&mut self) -> &mut State {
        self.world.state_mut()
    }

    fn push(&mut self, object: usize, force: Vec3, torque: Vec3) {
        self.world.push_object(object, force, torque);
    }

    fn outcome(&self) -> StepOutcome {
        *self.world.outcome()
    }

    fn world(&self) -> Option<&World> {
        Some(&self.world)
    }
}
