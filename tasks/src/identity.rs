//! Names of everything else that a run's bits depend on; task and hand have hashes of their own.

use crate::action::{Action, ActionError, BaseTarget};
use crate::run::Run;
use crate::seed::Seed;
use crate::settle::SceneError;
use crate::task::Task;
use palmares_models::Rotation;
use palmares_models::hand::Hand;
use palmares_sim::Config;

/// A run whose result identifies the engine.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceRun {
    /// Its name, that of its file in `tasks/golden`.
    pub name: &'static str,
    hand: &'static str,
    length_s: f64,
    script: fn(f64) -> Action,
    golden: &'static str,
}

/// The runs, in the task balls with seed 1. Every change of the physics that alters bits must change a result: together they are the
/// engine's true version. The SoftHand reaches into the box and closes; the fingers of `pinch`, which are boxes, close on each other.
pub const REFERENCE_RUNS: [ReferenceRun; 2] = [
    ReferenceRun {
        name: "balls_5s",
        hand: "softhand",
        length_s: 5.0,
        script: reaching,
        golden: include_str!("../golden/balls_5s.txt"),
    },
    ReferenceRun {
        name: "pinch_2s",
        hand: "pinch",
        length_s: 2.0,
        script: pinching,
        golden: include_str!("../golden/pinch_2s.txt"),
    },
];

/// The engine: its version and its [fingerprint].
pub fn engine() -> String {
    format!("{}+{}", env!("CARGO_PKG_VERSION"), fingerprint())
}

/// The results of the [reference runs](REFERENCE_RUNS) that this version must have, joined by dots.
pub fn fingerprint() -> String {
    REFERENCE_RUNS.map(|run| run.golden.trim()).join(".")
}

/// The constants of the physics in a task's worlds.
pub fn physics_hash(task: &Task) -> String {
    Config::with_step(task.step_s).content_hash()
}

/// The reference run cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceRunError {
    /// The program has no task `balls`, or not the hand.
    #[error("the task `balls` or the hand is not built in")]
    NotBuiltIn,
    /// The scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An action is refused.
    #[error(transparent)]
    Action(#[from] ActionError),
}

impl ReferenceRun {
    /// Its state hash at the end: the same number in every build and on every machine. `prepared`: every tick is
    /// [prepared](Run::prepare), as the server does while a controller thinks.
    ///
    /// # Errors
    /// Task or hand are not built in, or the run refuses the script.
    pub fn play(&self, prepared: bool) -> Result<String, ReferenceRunError> {
        let task = Task::builtin().into_iter().find(|task| task.name == "balls");
        let (task, hand) = task.zip(Hand::builtin(self.hand)).ok_or(ReferenceRunError::NotBuiltIn)?;
        let tick_s = task.tick_s;
        let mut run = Run::new(task, hand, Seed::from_u64(1))?;
        for k in 0..(self.length_s / tick_s) as u64 {
            if prepared {
                run.prepare();
            }
            run.step(&(self.script)(k as f64 * tick_s))?;
        }
        Ok(run.state_hash())
    }
}

fn reaching(t: f64) -> Action {
    let down = Rotation::from_rotation_y(std::f64::consts::PI).to_array();
    let (position, sigma) = match t {
        t if t < 0.1 => ([0.0, 0.0, 0.7], 0.0),
        t if t < 2.0 => ([0.05, 0.02, 0.28], 0.0),
        t if t < 3.0 => ([0.05, 0.02, 0.28], 1.0),
        _ => ([0.05, 0.02, 0.6], 1.0),
    };
    Action {
        base: Some(BaseTarget::Pose { position, quat_xyzw: down }),
        hand: Some(vec![sigma]),
        effort: None,
    }
}

fn pinching(t: f64) -> Action {
    let closed = if t % 0.6 < 0.3 { vec![0.4, 0.6] } else { vec![0.7, 0.2] };
    Action { base: None, hand: Some(closed), effort: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A release build printed the numbers in the files; this test runs in a debug build.
    #[test]
    fn every_build_reaches_the_same_states() {
        for run in REFERENCE_RUNS {
            for prepared in [false, true] {
                let result = run.play(prepared).expect("the run plays");
                assert_eq!(result, run.golden.trim(), "{}, every tick prepared: {prepared}", run.name);
            }
        }
    }
}
