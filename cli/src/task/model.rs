//! What a scene needs: its parts, the work of a step, and the laws of the physics that act.

use anyhow::Context;
use palmares_hand_tools::{Script, script};
use palmares_models::hand::Hand;
use palmares_sim::{Law, Parts, PhaseTimer, StepPhase, Tally, World};
use palmares_tasks::run::StepWatch;
use palmares_tasks::{Run, Seed, Task};
use serde::Serialize;
use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

/// The need of a scene. Numbers of a step are means over the run.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Needs {
    /// The hand that sweeps through the scene.
    hand: String,
    /// Steps of the run.
    steps: u64,
    /// Length of the generalized velocity.
    coordinates: usize,
    joints: usize,
    motors: usize,
    /// Rows of tendons, springs across joints, pins and dry friction.
    rows: usize,
    bodies: usize,
    shapes: usize,
    near_pairs: f64,
    /// Pairs and points in the solver.
    pairs: f64,
    points: f64,
    iterations: f64,
    /// Time of a step, µs, and its parts for dynamics, collision and solver.
    step_us: f64,
    time_parts: [f64; 3],
    /// Laws, and the part of the steps in which each acts.
    laws: Vec<ActiveLaw>,
}

#[derive(Clone, Debug, Serialize)]
struct ActiveLaw {
    name: &'static str,
    part_of_steps: f64,
}

/// The steps of a run.
struct Watch {
    tally: Tally,
    mark: Instant,
    /// Of each phase, in the order of [`StepPhase`].
    spent_s: [f64; 3],
}

impl PhaseTimer for Watch {
    fn ended(&mut self, phase: StepPhase) {
        let now = Instant::now();
        self.spent_s[phase as usize] += now.duration_since(self.mark).as_secs_f64();
        self.mark = now;
    }
}

impl StepWatch for Watch {
    fn stepped(&mut self, world: &World) {
        self.tally.add(world);
        self.mark = Instant::now();
    }
}

impl Needs {
    /// Those of a task's scene of seed 1, through which a hand sweeps.
    ///
    /// # Errors
    /// The scene cannot be built.
    pub(super) fn of(task: &Arc<Task>, hand: &Arc<Hand>) -> anyhow::Result<Self> {
        let mut run = Run::new(task.clone(), hand.clone(), Seed::from_u64(1))?;
        let mut watch = Watch { tally: Tally::default(), mark: Instant::now(), spent_s: [0.0; 3] };
        for action in script(Script::Sweep, task, hand.motors.len()) {
            if run.over().is_some() || !run.healthy() {
                break;
            }
            watch.mark = Instant::now();
            run.step_watched(&action, &mut watch).context("the script's actions fit every hand")?;
        }
        let Watch { tally, spent_s, .. } = watch;
        let Parts { coordinates, joints, motors, rows, bodies, shapes, .. } = Parts::of(run.world().model());
        let all_s: f64 = spent_s.iter().sum();
        let law =
            |law: &Law| ActiveLaw { name: law.name(), part_of_steps: tally.per_step(tally.acted(*law)) };
        Ok(Needs {
            hand: hand.name.clone(),
            steps: tally.steps,
            coordinates,
            joints,
            motors,
            rows,
            bodies,
            shapes,
            near_pairs: tally.per_step(tally.near_pairs),
            pairs: tally.per_step(tally.pairs),
            points: tally.per_step(tally.points),
            iterations: tally.per_step(tally.iterations),
            step_us: 1e6 * all_s / tally.steps.max(1) as f64,
            time_parts: spent_s.map(|part| part / all_s.max(1e-12)),
            laws: Law::ALL.iter().filter(|law| tally.acted(**law) > 0).map(law).collect(),
        })
    }

    /// As text.
    pub(super) fn text(&self) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "\nWhat it needs, {} steps in which `{}` sweeps through the scene",
            self.steps, self.hand
        );
        for (name, number) in [
            ("coordinates", self.coordinates),
            ("joints", self.joints),
            ("motors", self.motors),
            ("rows of tendons", self.rows),
            ("bodies", self.bodies),
            ("shapes", self.shapes),
        ] {
            let _ = writeln!(out, "  {name:<20}{number:>6}");
        }
        for (name, mean) in [
            ("near pairs", self.near_pairs),
            ("pairs in the solver", self.pairs),
            ("points", self.points),
            ("iterations", self.iterations),
        ] {
            let _ = writeln!(out, "  {name:<20}{mean:>8.1} a step");
        }
        let [dynamics, collision, solver] = self.time_parts.map(|part| 100.0 * part);
        let _ = writeln!(
            out,
            "  {:<20}{:>6.0} µs a step: dynamics {dynamics:.0} %, collision {collision:.0} %, solver {solver:.0} %",
            "time", self.step_us
        );
        out += "\nLaws that act, % of the steps\n";
        for law in &self.laws {
            let percent = match 100.0 * law.part_of_steps {
                rare if rare < 0.1 => "< 0.1".to_owned(),
                usual => format!("{usual:.1}"),
            };
            let _ = writeln!(out, "  {:<24}{percent:>6}", law.name);
        }
        out
    }
}
