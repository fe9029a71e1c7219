//! The sensors of a run: their selection and their errors.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Observations that a controller gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// Those of real sensors: actuators, wrist, touch.
    Sensors,
    /// The full state as well: the `truth` block.
    #[default]
    Truth,
}

/// Errors of the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Noise {
    /// Every reading is exact and of this very tick.
    #[default]
    None,
    /// Those of real sensors: resolution, noise, bias, drift, latency and drop-outs.
    Real,
}
