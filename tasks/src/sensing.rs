//! The sensors of a run: what they show, and how good they are.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much a controller may see.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// What real sensors give: actuators, wrist, touch.
    Sensors,
    /// The full state as well: the `truth` block.
    #[default]
    Truth,
}

/// How good the sensors are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Noise {
    /// Every reading is exact and of this very tick.
    #[default]
    None,
    /// As real sensors are: with resolution, noise, bias, drift, latency and drop-outs.
    Real,
}
