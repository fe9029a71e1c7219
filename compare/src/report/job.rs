//! The runs of a case on an engine.

use crate::engine::EngineKind;
use palmares_bench::cases::Case;

/// Runs one case on one engine with all steps; several jobs run at once, since nothing is timed.
pub(super) struct Job {
    pub case: &'static Case,
    pub kind: EngineKind,
    /// [Identity](crate::scene_id) of the case.
    pub scene: String,
    /// [Key](crate::peer_key) of a peer's run at each step; empty for ours.
    pub keys: Vec<String>,
    /// Simulated time of a run, s.
    pub simulated_s: f64,
}
