//! Identities of the engine and of the physical constants, which a run's bits depend on. Task and hand have hashes of
//! their own.

use palmares_sim::Config;
use palmares_tasks::Task;

/// State hash of the reference run of five seconds. It changes whenever a change of the physics alters bits: it is
/// the engine's version.
const FINGERPRINT: &str = include_str!("../../bench/golden/balls_5s.txt");

/// The engine: version, and state hash of the reference run.
pub(crate) fn engine() -> String {
    format!("{}+{}", env!("CARGO_PKG_VERSION"), FINGERPRINT.trim())
}

/// The constants of the physics in a task's worlds.
pub(crate) fn physics_hash(task: &Task) -> String {
    Config::with_step(task.step_s).content_hash()
}
