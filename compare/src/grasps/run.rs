//! One run of a count of grasps.

use crate::trials::play::Fate;
use serde::{Deserialize, Serialize};

/// One grasp in one engine at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Hand, family and the grasp's place in it.
    pub hand: String,
    /// The family.
    pub family: String,
    /// The grasp.
    pub index: usize,
    /// Engine and settings.
    pub engine: String,
    /// Name of its settings.
    pub settings: String,
    /// ms
    pub step_ms: f64,
    /// Shift of the object from its drawn place, µm.
    #[serde(default)]
    pub aside_um: f64,
    /// Identity of its scene and set point.
    #[serde(default)]
    pub scene: String,
    /// [Key](crate::peer_key) of a peer's run; none of ours.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// The outcome.
    pub fate: Fate,
    /// Wall-clock time of the run, s: for the estimate of the time left.
    pub wall_s: f64,
}
