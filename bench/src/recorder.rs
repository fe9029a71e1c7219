//! Steps an engine and adds up its time and its errors.

use crate::case_report::{Invariants, Times};
use crate::engine::Engine;
use crate::measured::Measured;
use crate::overlap;
use anyhow::{Result, bail};
use palmares_sim::{Command, Model};
use std::sync::Arc;
use std::time::Instant;

/// CPU time of the stepping thread, its split by phase, and errors.
#[derive(Default)]
pub struct Recorder {
    phases_s: [f64; 3],
    worst_s: f64,
    total_s: f64,
    steps: u64,
    unconverged: u64,
    penetration_m: f64,
    scene: Option<(Arc<Model>, f64)>,
    /// Deepest overlap as a part of its bound, and the bound, m.
    nearest: (f64, f64),
    iterations: u64,
    iterations_max: usize,
    /// Largest CPU time, s, and the begin of the run.
    longest: Option<(f64, Instant)>,
    /// The measurements of the case on a hand.
    pub measured: Vec<Measured>,
}

impl Recorder {
    /// A recorder that ends a run after this CPU time of steps, s, for timings that need only its first part; and after twice this
    /// time of the clock, where a case starts scene after scene.
    pub fn for_at_most(longest_s: f64) -> Self {
        Recorder { longest: Some((longest_s, Instant::now())), ..Recorder::default() }
    }

    /// Whether it ended the run.
    pub fn broke_off(&self) -> bool {
        self.longest.is_some_and(|(longest_s, begun)| {
            self.total_s > longest_s || begun.elapsed().as_secs_f64() > 2.0 * longest_s
        })
    }

    /// One step.
    pub fn step(&mut self, engine: &mut dyn Engine, command: &Command) -> Result<()> {
        if self.broke_off() {
            bail!("long enough for a timing");
        }
        let cost = engine.step(command)?;
        self.total_s += cost.total_s;
        self.worst_s = self.worst_s.max(cost.total_s);
        for (sum, spent) in self.phases_s.iter_mut().zip(cost.phases_s) {
            *sum += spent;
        }
        self.steps += 1;
        let outcome = engine.outcome();
        self.unconverged += u64::from(!outcome.converged || !engine.state().is_finite());
        self.penetration_m = self.penetration_m.max(outcome.penetration_m);
        let bound_m = self.overlap_bound_m(engine.model(), outcome.penetration_m);
        if outcome.penetration_m > self.nearest.0 * bound_m {
            self.nearest = (outcome.penetration_m / bound_m, bound_m);
        }
        self.iterations += outcome.iterations as u64;
        self.iterations_max = self.iterations_max.max(outcome.iterations);
        Ok(())
    }

    /// `count` steps under one command.
    pub fn steps(&mut self, engine: &mut dyn Engine, command: &Command, count: u64) -> Result<()> {
        (0..count).try_for_each(|_| self.step(engine, command))
    }

    /// The bound of a scene, found at its first step.
    fn overlap_bound_m(&mut self, model: &Arc<Model>, first_m: f64) -> f64 {
        match &self.scene {
            Some((known, bound_m)) if Arc::ptr_eq(known, model) => *bound_m,
            _ => {
                let bound_m = overlap::bound_m(model, first_m);
                self.scene = Some((Arc::clone(model), bound_m));
                bound_m
            }
        }
    }

    /// Mean times per step.
    pub fn times(&self) -> Times {
        let total = self.total_s * 1e6 / self.steps.max(1) as f64;
        let share = |k: usize| self.phases_s[k] / self.phases_s.iter().sum::<f64>().max(1e-12) * total;
        let [dynamics, collision, solver] = [0, 1, 2].map(share);
        Times { dynamics, collision, solver, total, worst: self.worst_s * 1e6 }
    }

    /// Simulated time per CPU time at step `dt_s`; 0 for a case that records no steps.
    pub fn rtf(&self, dt_s: f64) -> f64 {
        self.steps as f64 * dt_s / self.total_s.max(1e-12)
    }

    /// Mean and largest number of Newton iterations.
    pub fn newton(&self) -> (f64, usize) {
        (self.iterations as f64 / self.steps.max(1) as f64, self.iterations_max)
    }

    /// The checks that every case has.
    pub fn invariants(&self) -> Invariants {
        Invariants {
            max_penetration_mm: Some(self.penetration_m * 1e3),
            overlap_bound_mm: (self.nearest.0 > 0.0).then_some(self.nearest.1 * 1e3),
            overlap_of_bound: (self.nearest.0 > 0.0).then_some(self.nearest.0),
            newton_unconverged: Some(self.unconverged),
            ..Invariants::default()
        }
    }
}
