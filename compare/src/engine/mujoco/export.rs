//! A scene, and what drives it, for MuJoCo's own programs.

use serde::Serialize;

/// A scene as MuJoCo takes it.
#[derive(Debug, Serialize)]
pub struct Exported {
    /// An MJCF document.
    #[serde(skip)]
    pub xml: String,
    /// Positions to begin from, as MuJoCo numbers them.
    pub qpos: Vec<f64>,
    /// Velocities to begin from.
    pub qvel: Vec<f64>,
    /// The commands: a row of set points for each step.
    pub ctrl: Vec<Vec<f64>>,
}
