//! What a run of a case comes to.

use super::case::{Figure, Invariants, Report};
use super::comparison::trouble;
use serde::{Deserialize, Serialize};

/// A run that came to an end, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Played {
    /// The case's figure; without a value where that is not finite, for JSON knows no infinities.
    pub error: Figure,
    /// Its checks.
    pub invariants: Invariants,
    /// Why it does not do what the scene asks for, if so.
    pub trouble: Option<String>,
}

impl Played {
    /// Judges what a case said.
    pub fn of(report: Report) -> Self {
        let Report { error, invariants, .. } = report;
        let trouble = trouble(&error, &invariants);
        let value = error.value.filter(|x| x.is_finite());
        Played { error: Figure { value, ..error }, invariants, trouble }
    }
}
