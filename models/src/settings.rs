//! `hand.toml`: what a URDF has no place for.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::load::InertiaPolicy;

/// The file beside a URDF. All of it is optional.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Settings {
    /// Replaces the URDF's robot name.
    pub(crate) name: Option<String>,
    pub(crate) description: Option<String>,
    pub(crate) gravity_compensation: Option<bool>,
    /// Coulomb friction coefficient of every surface that [links] does not name.
    pub(crate) friction: Option<f64>,
    pub(crate) inertia: Option<InertiaPolicy>,
    /// By name of the URDF's actuator.
    #[serde(default)]
    pub(crate) motors: BTreeMap<String, MotorSettings>,
    /// By name of the URDF's transmission.
    #[serde(default)]
    pub(crate) tendons: BTreeMap<String, TendonSettings>,
    /// What holds for every coordinate that [coordinates] does not name.
    #[serde(default)]
    pub(crate) every_coordinate: CoordinateSettings,
    /// By name of the URDF's joint.
    #[serde(default)]
    pub(crate) coordinates: BTreeMap<String, CoordinateSettings>,
    /// By name of the URDF's link.
    #[serde(default)]
    pub(crate) links: BTreeMap<String, LinkSettings>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MotorSettings {
    pub(crate) scaling: f64,
    #[serde(default)]
    pub(crate) offset: f64,
    /// 1/s
    pub(crate) speed_limit: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TendonSettings {
    pub(crate) stiffness: f64,
    #[serde(default)]
    pub(crate) damping: f64,
    pub(crate) force_limit: f64,
}

/// Overrides of what the URDF says.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CoordinateSettings {
    /// N·m/rad
    pub(crate) stiffness: Option<f64>,
    /// N·m·s/rad
    pub(crate) damping: Option<f64>,
    /// rad
    pub(crate) rest: Option<f64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkSettings {
    /// kg; the inertia then comes from the geometry.
    pub(crate) mass: Option<f64>,
    /// Edge radius of the link's boxes, m; URDF boxes are sharp.
    pub(crate) rounding: Option<f64>,
    pub(crate) friction: Option<f64>,
}
