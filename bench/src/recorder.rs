//! Steps a world and keeps the time.

use crate::report::{Invariants, Times};
use cpu_time::ThreadTime;
use palmares_sim::world::{Phase, Probe};
use palmares_sim::{Command, World};
use std::time::Instant;

/// CPU time of this thread per step, its split by phase, and what went wrong.
///
/// Reading a thread's CPU time is a system call; it is made once a step. The phases are timed with the cheap
/// wall clock, and only their ratios are used.
pub struct Recorder {
    mark: Instant,
    phases: [f64; 3],
    worst_s: f64,
    total_s: f64,
    steps: u64,
    unconverged: u64,
    penetration_m: f64,
    iterations: u64,
    iterations_max: usize,
}

impl Default for Recorder {
    fn default() -> Self {
        Recorder {
            mark: Instant::now(),
            phases: [0.0; 3],
            worst_s: 0.0,
            total_s: 0.0,
            steps: 0,
            unconverged: 0,
            penetration_m: 0.0,
            iterations: 0,
            iterations_max: 0,
        }
    }
}

impl Probe for Recorder {
    fn ended(&mut self, phase: Phase) {
        let now = Instant::now();
        let k = match phase {
            Phase::Dynamics => 0,
            Phase::Collision => 1,
            Phase::Solver => 2,
        };
        self.phases[k] += now.duration_since(self.mark).as_secs_f64();
        self.mark = now;
    }
}

impl Recorder {
    /// One step.
    pub fn step(&mut self, world: &mut World, command: &Command) {
        let start = ThreadTime::now();
        self.mark = Instant::now();
        world.step_probed(command, self);
        let spent = start.elapsed().as_secs_f64();
        self.worst_s = self.worst_s.max(spent);
        self.total_s += spent;
        self.steps += 1;
        let outcome = world.outcome();
        self.unconverged += u64::from(!outcome.converged || !world.state().is_finite());
        self.penetration_m = self.penetration_m.max(outcome.penetration_m);
        self.iterations += outcome.iterations as u64;
        self.iterations_max = self.iterations_max.max(outcome.iterations);
    }

    /// Mean times per step.
    pub fn times(&self) -> Times {
        let total = self.total_s * 1e6 / self.steps.max(1) as f64;
        let share = |k: usize| self.phases[k] / self.phases.iter().sum::<f64>().max(1e-12) * total;
        Times { dynamics: share(0), collision: share(1), solver: share(2), total, worst: self.worst_s * 1e6 }
    }

    /// Simulated time per CPU time at step `dt_s`.
    pub fn rtf(&self, dt_s: f64) -> f64 {
        self.steps as f64 * dt_s / self.total_s
    }

    /// Mean and largest number of Newton iterations.
    pub fn newton(&self) -> (f64, usize) {
        (self.iterations as f64 / self.steps.max(1) as f64, self.iterations_max)
    }

    /// What every case can tell.
    pub fn invariants(&self) -> Invariants {
        Invariants {
            max_penetration_mm: Some(self.penetration_m * 1e3),
            newton_unconverged: Some(self.unconverged),
            ..Invariants::default()
        }
    }
}
