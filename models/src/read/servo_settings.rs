//! The servos of `hand.toml`.

use serde::Deserialize;

use super::report::Report;
use crate::error::ModelError;
use crate::hand::number::{Bounds, Field, Number, Visit, table};

table! {
    /// Overrides of what the URDF's `<limit>` says, for the servo of a joint.
    #[derive(Copy, Default)]
    pub(crate) table ServoSettings;
    /// Largest torque, N·m (largest force, N).
    effort: Option<f64> = Number { unit: "N·m", bounds: Bounds::Positive, ..Number::OF_TABLE },
    /// Largest speed, rad/s (m/s).
    velocity: Option<f64> = Number { unit: "rad/s", bounds: Bounds::Positive, ..Number::OF_TABLE },
    /// N·m/rad (N/m)
    stiffness: Option<f64> = Number { unit: "N·m/rad", bounds: Bounds::Positive, ..Number::OF_TABLE },
    /// N·m·s/rad (N·s/m)
    damping: Option<f64> = Number { unit: "N·m·s/rad", bounds: Bounds::NotNegative, ..Number::OF_TABLE },
    /// Positions of the joint at σ = 0 and at σ = 1, rad (m).
    range: Option<ServoRange> = Number { unit: "rad", ..Number::OF_TABLE },
}

/// Both ends of a servo's range.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(transparent)]
pub(crate) struct ServoRange(#[serde(deserialize_with = "crate::exact::array")] pub(crate) [f64; 2]);

impl Field for ServoRange {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        self.0.visit(number, name, each);
        let [begin, end] = self.0;
        if begin == end {
            each(&Number { bounds: Bounds::NotZero, ..*number }, "range, end minus begin,", Some(0.0));
        }
    }
}

/// The joints that have servos.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum ServoJoints {
    /// `"all"`: each that no tendon pulls.
    Word(String),
    /// The joints of these names.
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
