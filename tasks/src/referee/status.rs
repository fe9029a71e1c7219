//! Why an object counts or does not, in the rules' own numbers.

use schemars::JsonSchema;
use serde::Serialize;

/// What the referee thinks of an object.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Verdict")]
pub struct ObjectStatus {
    /// Which object, in scene order.
    pub object: usize,
    /// Whether it gives points for being where it should be.
    pub counts: bool,
    /// Where it is, as far as the rules care: `goal`, `start`, `outside`, `on_the_way`; where one object is held: `down`,
    /// `up`, `shaking`, `lost`, `kept`; where objects are arranged: the name of the goal that comes next, `later` if that
    /// is another object's, `done`, `none` for an object of no goal.
    pub place: String,
    /// The rules it is measured by.
    pub reasons: Vec<Measured>,
}

/// A rule and what was measured.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Measured {
    /// `in_goal`, `at_rest`, `in_start`; `lifted`, `held`, `no_slip`, `shaken`; `inside`, `within`, `above`, `upright`,
    /// `at_rest`, `let_go`, `held`.
    pub rule: String,
    /// Whether it holds.
    pub holds: bool,
    /// What was measured; none before there is anything to measure.
    pub value: Option<f64>,
    /// What it is compared with.
    pub limit: f64,
    /// Unit of both.
    pub unit: String,
}

impl Measured {
    pub(super) fn new(rule: &str, holds: bool, value: Option<f64>, limit: f64, unit: &str) -> Self {
        // What is no number is told as none.
        let value = value.filter(|value| value.is_finite());
        Measured { rule: rule.to_owned(), holds, value, limit, unit: unit.to_owned() }
    }
}
