//! Our engine without some laws, watched in all its steps.

use crate::engine::{Cost, Engine, EngineFactory, OwnFactory};
use anyhow::Result;
use palmares_models::Vec3;
use palmares_sim::{Command, ContactForce, Laws, Model, Parts, State, StepOutcome, Tally, World};
use parking_lot::Mutex;
use std::sync::Arc;

/// The steps of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// The parts of its scene; of several, of the one with the most coordinates.
    pub parts: Parts,
    /// Sums over all steps.
    pub tally: Tally,
    /// CPU time of all steps, s.
    pub total_s: f64,
    /// The same in parts: dynamics, collision, solver. Only the ratios are used.
    pub phases_s: [f64; 3],
}

impl Seen {
    /// CPU time of a step, µs.
    pub(super) fn us_per_step(&self) -> f64 {
        1e6 * self.total_s / self.tally.steps.max(1) as f64
    }
}

/// Our engine for one run.
#[derive(Debug)]
pub(super) struct WatchedFactory {
    without: Laws,
    seen: Arc<Mutex<Seen>>,
}

impl WatchedFactory {
    /// One without some laws. A setup is copied to every scene of a case, so that it lives as long as the program.
    pub(super) fn new(without: Laws) -> &'static Self {
        Box::leak(Box::new(WatchedFactory { without, seen: Arc::default() }))
    }

    /// The steps up to now.
    pub(super) fn seen(&self) -> Seen {
        self.seen.lock().clone()
    }
}

impl EngineFactory for WatchedFactory {
    fn name(&self) -> &'static str {
        "own"
    }

    fn settings(&self) -> &'static str {
        "watched"
    }

    fn start(&self, mut model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        for law in self.without.iter() {
            Arc::make_mut(&mut model).leave_out(law);
        }
        let parts = Parts::of(&model);
        {
            let mut seen = self.seen.lock();
            if parts.coordinates >= seen.parts.coordinates {
                seen.parts = parts;
            }
        }
        Ok(Box::new(Watched { own: OwnFactory.start(model, state)?, seen: Arc::clone(&self.seen) }))
    }
}

struct Watched {
    own: Box<dyn Engine>,
    seen: Arc<Mutex<Seen>>,
}

impl Engine for Watched {
    fn model(&self) -> &Arc<Model> {
        self.own.model()
    }

    fn step(&mut self, command: &Command) -> Result<Cost> {
        let cost = self.own.step(command)?;
        let mut seen = self.seen.lock();
        seen.total_s += cost.total_s;
        seen.phases_s.iter_mut().zip(cost.phases_s).for_each(|(sum, spent)| *sum += spent);
        if let Some(world) = self.own.world() {
            seen.tally.add(world);
        }
        Ok(cost)
    }

    fn state(&self) -> &State {
        self.own.state()
    }

    fn state_mut(&mut self) -> &mut State {
        self.own.state_mut()
    }

    fn push(&mut self, object: usize, force: Vec3, torque: Vec3) {
        self.own.push(object, force, torque);
    }

    fn outcome(&self) -> StepOutcome {
        self.own.outcome()
    }

    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        self.own.contacts()
    }

    fn world(&self) -> Option<&World> {
        self.own.world()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::{Setup, run};
    use palmares_sim::Law;

    #[test]
    fn a_run_without_a_law_is_seen_in_all_its_steps_and_is_another() {
        let play = |without: &[Law]| {
            let mut laws = Laws::default();
            without.iter().for_each(|law| laws.insert(*law));
            let factory = WatchedFactory::new(laws);
            let (report, _) = run("slide_stop", &Setup::new(factory, 4e-3)).expect("it is played");
            (report.error.value.expect("an analytic answer"), factory.seen())
        };
        let (whole, seen) = play(&[]);
        assert!(seen.tally.acted(Law::ObjectOrder) > 0 && seen.tally.acted(Law::HandOrder) == 0);
        assert!(seen.parts.coordinates == 6 && seen.total_s > 0.0);
        let (without, left) = play(&[Law::ObjectOrder]);
        assert!(without != whole && left.tally.acted(Law::ObjectOrder) == 0);
        assert_eq!(play(&[Law::HandOrder]).0, whole);
    }
}
