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
    #[serde(default, deserialize_with = "crate::exact::array")]
    pub(crate) position: [f64; 3],
    #[serde(default, deserialize_with = "crate::exact::optional")]
    pub(crate) quat_xyzw: Option<[f64; 4]>,
    /// Fixed-axis roll, pitch, yaw, rad.
    #[serde(default, deserialize_with = "crate::exact::optional")]
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
    /// Every number in it, with its field.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let position = self.position.into_iter().map(|x| ("position", x));
        let quat = self.quat_xyzw.into_iter().flatten().map(|x| ("quat_xyzw", x));
        let rpy = self.rpy.into_iter().flatten().map(|x| ("rpy", x));
        position.chain(quat).chain(rpy)
    }
}
