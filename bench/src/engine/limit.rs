//! A limit on the CPU time of runs of other engines: some take an hour without saying more than shorter ones, and some never
//! end. It is checked before every step. In a process that [`enforce`]s it, a step that outlasts it ends the process. By the
//! clock on the wall, other work on the machine would decide which runs end.

use super::interface::{Cost, Engine};
use anyhow::Result;
use cpu_time::{ProcessTime, ThreadTime};
use palmares_models::Vec3;
use palmares_sim::{Command, Model, State};
use palmares_sim::{ContactForce, StepOutcome};
use parking_lot::Mutex;
use std::cell::Cell;
use std::process::exit;
use std::sync::Arc;
use std::thread::{sleep, spawn};
use std::time::Duration;

/// Exit code of a process that ends because a step outlasts the limit.
pub const EXIT_CODE: i32 = 75;
/// A process that enforces the limit may take this much longer, s, since work between steps counts there as well; and how
/// often this is checked.
const GRACE_S: f64 = 2.0;
const LOOK_EVERY: Duration = Duration::from_millis(100);

thread_local! {
    static LIMIT: Cell<Option<Limit>> = const { Cell::new(None) };
}

#[derive(Clone, Copy)]
struct Limit {
    allowed_s: f64,
    spent_s: f64,
}

/// CPU time of a process that enforces it at which the limit of its run is over, s.
static END_S: Mutex<Option<f64>> = Mutex::new(None);

fn cpu_s() -> f64 {
    ProcessTime::now().as_duration().as_secs_f64()
}

/// A run of a peer did not end in time: it says nothing, good or bad.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("not finished within {allowed_s} s")]
pub struct NotFinished {
    /// Its limit, s.
    pub allowed_s: f64,
}

/// A step of a peer failed in a run with a limit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a step failed at {at_s:.3} s")]
pub struct StepFailed {
    /// Simulated time, s.
    pub at_s: f64,
}

/// From now on a step that outlasts its run's limit ends this process with [`EXIT_CODE`]. This is for a process that plays
/// one run at a time for a parent that can start another.
pub fn enforce() {
    spawn(|| {
        loop {
            sleep(LOOK_EVERY);
            let end_s = *END_S.lock();
            if end_s.is_some_and(|end_s| cpu_s() > end_s + GRACE_S) {
                exit(EXIT_CODE);
            }
        }
    });
}

/// Sets the limit of this thread and returns the one before.
fn replace(limit: Option<Limit>) -> Option<Limit> {
    let end_s = limit.map(|limit| cpu_s() + limit.allowed_s - limit.spent_s);
    *END_S.lock() = end_s;
    LIMIT.replace(limit)
}

/// Runs `run`, which ends with an error after `allowed_s` of CPU time in steps of peers, or when one of them fails.
pub fn within<T>(allowed_s: f64, run: impl FnOnce() -> T) -> T {
    let before = replace(Some(Limit { allowed_s, spent_s: 0.0 }));
    let outcome = run();
    replace(before);
    outcome
}

/// Runs `run` with a limit of its own of the same length, where there is one: a reference is no part of the first run that
/// needs it.
pub fn with_own_limit<T>(run: impl FnOnce() -> T) -> T {
    match LIMIT.get() {
        Some(outer) => within(outer.allowed_s, run),
        None => run(),
    }
}

/// The CPU time of the present run, s, where it has a limit.
pub fn allowed_s() -> Option<f64> {
    LIMIT.get().map(|limit| limit.allowed_s)
}

/// Whether the present run has used up its time.
pub fn used_up() -> bool {
    LIMIT.get().is_some_and(|limit| limit.spent_s >= limit.allowed_s)
}

fn spend(seconds: f64) {
    LIMIT.set(LIMIT.get().map(|limit| Limit { spent_s: limit.spent_s + seconds, ..limit }));
}

/// A peer that steps until its limit.
pub struct Limited(pub Box<dyn Engine>);

impl Engine for Limited {
    fn model(&self) -> &Arc<Model> {
        self.0.model()
    }

    fn step(&mut self, command: &Command) -> Result<Cost> {
        if let Some(limit) = LIMIT.get().filter(|_| used_up()) {
            return Err(NotFinished { allowed_s: limit.allowed_s }.into());
        }
        let begin = ThreadTime::now();
        let cost = self.0.step(command)?;
        // MuJoCo and Drake step in another process, and report their time.
        spend(cost.total_s.max(begin.elapsed().as_secs_f64()));
        // A run with a failed step is of no use; finishing it would take a report an hour.
        if LIMIT.get().is_some() && !self.0.outcome().converged {
            return Err(
                StepFailed { at_s: self.0.state().step as f64 * self.0.model().config().step_s }.into()
            );
        }
        Ok(cost)
    }

    fn state(&self) -> &State {
        self.0.state()
    }

    fn state_mut(&mut self) -> &mut State {
        self.0.state_mut()
    }

    fn push(&mut self, object: usize, force: Vec3, torque: Vec3) {
        self.0.push(object, force, torque);
    }

    fn outcome(&self) -> StepOutcome {
        self.0.outcome()
    }

    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        self.0.contacts()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::{self, Setup};
    use crate::engine::{EngineFactory, OwnFactory};

    /// Ours under a peer's rules.
    #[derive(Debug)]
    struct Peer;

    impl EngineFactory for Peer {
        fn name(&self) -> &'static str {
            "peer"
        }

        fn settings(&self) -> &'static str {
            "default"
        }

        fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
            Ok(Box::new(Limited(OwnFactory.start(model, state)?)))
        }
    }

    fn run(engine: &'static dyn EngineFactory) -> Result<()> {
        cases::run("bowling", &Setup::new(engine, 8e-3)).map(|_| ())
    }

    #[test]
    fn a_peer_ends_with_its_time_and_ours_does_not() {
        let error = within(0.0, || run(&Peer)).expect_err("there is no time");
        assert_eq!(error.downcast_ref(), Some(&NotFinished { allowed_s: 0.0 }));
        within(0.0, || run(&OwnFactory)).expect("ours has no limit");
        within(600.0, || run(&Peer)).expect("there is time");
        run(&Peer).expect("there is no limit");
    }

    #[test]
    fn a_run_with_a_limit_of_its_own_takes_no_time_of_the_run_around_it() {
        within(2.0, || {
            spend(1.5);
            with_own_limit(|| {
                assert!(!used_up());
                spend(2.1);
                assert!(used_up());
            });
            assert!(!used_up());
            spend(0.6);
            assert!(used_up());
        });
        assert!(!used_up());
    }
}
