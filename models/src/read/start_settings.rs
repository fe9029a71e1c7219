//! Base frame and start of `hand.toml`.

use std::collections::BTreeMap;

use serde::Deserialize;

/// Pose of the hand's base frame: the flange at its wrist, z along the fingers, x out of the palm.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BaseSettings {
    /// The link whose frame `position` and the turn are in; else the root. Fixed joints lead to it.
    pub(crate) link: Option<String>,
    /// m
    #[serde(default)]
    pub(crate) position: [f64; 3],
    pub(crate) quat_xyzw: Option<[f64; 4]>,
    /// Fixed-axis roll, pitch, yaw, rad.
    pub(crate) rpy: Option<[f64; 3]>,
}

/// How a run begins.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartSettings {
    /// σ of every motor that `motors` does not name.
    pub(crate) sigma: Option<f64>,
    /// σ by motor.
    #[serde(default)]
    pub(crate) motors: BTreeMap<String, f64>,
    /// Positions by joint, rad (m).
    #[serde(default)]
    pub(crate) joints: BTreeMap<String, f64>,
}

impl BaseSettings {
    /// Every number in it.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let turn = self.quat_xyzw.into_iter().flatten().chain(self.rpy.into_iter().flatten());
        self.position.into_iter().chain(turn)
    }
}
