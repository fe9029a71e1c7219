//! Base frame and start of `hand.toml`.

use std::collections::BTreeMap;

use crate::hand::number::{Bounds, Number, table};

table! {
    /// Pose of the hand's base frame: the flange at its wrist, z along the fingers, x out of the palm.
    #[derive(Default)]
    pub(crate) table BaseSettings;
    /// The link whose frame `position` and the turn are in; else the root. Fixed joints lead to it.
    link: Option<String> = Number::OF_TABLE,
    /// m
    #[serde(default, deserialize_with = "crate::exact::array")]
    position: [f64; 3] = PLACE,
    /// Unit quaternion.
    #[serde(default, deserialize_with = "crate::exact::optional")]
    quat_xyzw: Option<[f64; 4]> = PLACE,
    /// Fixed-axis roll, pitch, yaw, rad.
    #[serde(default, deserialize_with = "crate::exact::optional")]
    rpy: Option<[f64; 3]> = PLACE,
}

/// Turns have the limit of lengths, too.
const PLACE: Number = Number { unit: "m", ..Number::OF_TABLE };

table! {
    /// How a run begins.
    #[derive(Default)]
    pub(crate) table StartSettings;
    /// σ of every motor that `motors` does not name.
    sigma: Option<f64> = Number { bounds: Bounds::Part, ..Number::OF_TABLE },
    /// σ by motor.
    #[serde(default)]
    motors: BTreeMap<String, f64> = Number { bounds: Bounds::Part, ..Number::OF_TABLE },
    /// Positions by joint, rad (m).
    #[serde(default)]
    joints: BTreeMap<String, f64> = Number { unit: "rad", ..Number::OF_TABLE },
}
