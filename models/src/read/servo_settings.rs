//! The servos of `hand.toml`.

use serde::Deserialize;

use super::report::Report;
use crate::error::ModelError;

/// Overrides of what the URDF's `<limit>` says, for the servo of a joint.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ServoSettings {
    /// Largest torque, N·m (largest force, N).
    pub(crate) effort: Option<f64>,
    /// Largest speed, rad/s (m/s).
    pub(crate) velocity: Option<f64>,
    /// N·m/rad (N/m)
    pub(crate) stiffness: Option<f64>,
    /// N·m·s/rad (N·s/m)
    pub(crate) damping: Option<f64>,
    /// Positions of the joint at σ = 0 and at σ = 1, rad (m).
    #[serde(default, deserialize_with = "crate::exact::optional")]
    pub(crate) range: Option<[f64; 2]>,
}

/// The joints that have servos.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum ServoJoints {
    /// `"all"`: each that no tendon pulls.
    Word(String),
    /// Those of these names.
    Names(Vec<String>),
}

impl ServoJoints {
    /// Rejects another word than `all`.
    pub(crate) fn check(&self, at: &Report) -> Result<(), ModelError> {
        match self {
            ServoJoints::Word(word) if word != "all" => {
                let valid = "\"all\", or a list of joints";
                Err(at.bad("servo_joints", format!("is '{word}'"), valid))
            }
            _ => Ok(()),
        }
    }

    /// The listed names.
    pub(crate) fn names(&self) -> &[String] {
        match self {
            ServoJoints::Word(_) => &[],
            ServoJoints::Names(names) => names,
        }
    }
}
