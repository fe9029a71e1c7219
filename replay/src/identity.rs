//! Names for what a run's bits depend on, beside the task and the hand, which hash themselves.

use palmares_sim::Config;
use palmares_tasks::Task;

/// The number of the reference run of five seconds. It changes with every change of the physics that alters bits. It is in this crate,
/// which a source distribution contains; `bench/golden` links to it.
const FINGERPRINT: &str = include_str!("../golden/balls_5s.txt");

/// The engine: its version and what its reference run comes to.
pub(crate) fn engine() -> String {
    format!("{}+{}", env!("CARGO_PKG_VERSION"), FINGERPRINT.trim())
}

/// The constants of the physics in a task's worlds.
pub(crate) fn physics_hash(task: &Task) -> String {
    Config::with_step(task.step_s).content_hash()
}
