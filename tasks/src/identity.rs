//! Names of everything else that a run's bits depend on; task and hand have hashes of their own.

use crate::action::{Action, ActionError, BaseTarget};
use crate::run::Run;
use crate::seed::Seed;
use crate::settle::SceneError;
use crate::task::Task;
use palmares_models::Rotation;
use palmares_models::hand::Hand;
use palmares_sim::Config;

/// The result of the [reference run](reference_run). Every change of the physics that alters bits changes it: it is the
/// engine's true version.
const FINGERPRINT: &str = include_str!("../golden/balls_5s.txt");

/// The engine: its version and the result of its reference run.
pub fn engine() -> String {
    format!("{}+{}", env!("CARGO_PKG_VERSION"), FINGERPRINT.trim())
}

/// The constants of the physics in a task's worlds.
pub fn physics_hash(task: &Task) -> String {
    Config::with_step(task.step_s).content_hash()
}

/// The reference run cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceRunError {
    /// The program has no task `balls` or no hand `softhand`.
    #[error("the task `balls` or the hand `softhand` is not built in")]
    NotBuiltIn,
    /// The scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An action is refused.
    #[error(transparent)]
    Action(#[from] ActionError),
}

/// State hash of the balls task with the SoftHand and seed 1 after 5 s of reaching into the box and closing: the same
/// number in every build and on every machine. `prepared`: every tick is [prepared](Run::prepare), as the server does
/// while a controller thinks.
///
/// # Errors
/// Task or hand are not built in, or the run refuses the script.
pub fn reference_run(prepared: bool) -> Result<String, ReferenceRunError> {
    let task = Task::builtin().into_iter().find(|task| task.name == "balls");
    let (task, hand) = task.zip(Hand::builtin("softhand")).ok_or(ReferenceRunError::NotBuiltIn)?;
    let tick_s = task.tick_s;
    let mut run = Run::new(task, hand, Seed::from_u64(1))?;
    for k in 0..(5.0 / tick_s) as u64 {
        if prepared {
            run.prepare();
        }
        run.step(&scripted_action(k as f64 * tick_s))?;
    }
    Ok(run.state_hash())
}

fn scripted_action(t: f64) -> Action {
    let down = Rotation::from_rotation_y(std::f64::consts::PI).to_array();
    let (position, sigma) = match t {
        t if t < 0.1 => ([0.0, 0.0, 0.7], 0.0),
        t if t < 2.0 => ([0.05, 0.02, 0.28], 0.0),
        t if t < 3.0 => ([0.05, 0.02, 0.28], 1.0),
        _ => ([0.05, 0.02, 0.6], 1.0),
    };
    Action { base: Some(BaseTarget::Pose { position, quat_xyzw: down }), hand: Some(vec![sigma]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A release build printed the number in the file; this test runs in a debug build.
    #[test]
    fn every_build_reaches_the_same_state() {
        assert_eq!(reference_run(false).expect("the run plays"), FINGERPRINT.trim());
        assert_eq!(reference_run(true).expect("the run plays"), FINGERPRINT.trim(), "every tick prepared");
    }
}
