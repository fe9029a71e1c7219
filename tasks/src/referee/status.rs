//! Status of an object under the rules, with the measured values.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Status of an object under the rules.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Verdict")]
pub struct ObjectStatus {
    /// Index of the object, in scene order.
    pub object: usize,
    /// Whether the object gives points for its place.
    pub counts: bool,
    /// Place or stage of the object: section 4 of docs/tasks.md lists them.
    pub place: String,
    /// The conditions that decide.
    pub reasons: Vec<Measured>,
}

/// A condition with its measured value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Measured {
    /// Name of the condition: section 4 of docs/tasks.md lists them.
    pub rule: String,
    /// Whether the condition holds.
    pub holds: bool,
    /// The measured value; absent before the first measurement.
    pub value: Option<f64>,
    /// The limit of the value.
    pub limit: f64,
    /// Unit of value and limit.
    pub unit: String,
}

impl Measured {
    pub(crate) fn new(rule: &str, holds: bool, value: Option<f64>, limit: f64, unit: &str) -> Self {
        // JSON has no infinity and no NaN.
        let value = value.filter(|value| value.is_finite());
        Measured { rule: rule.to_owned(), holds, value, limit, unit: unit.to_owned() }
    }
}
