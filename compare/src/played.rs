//! The result of a run of a case.

use palmares_bench::case_report::{CaseReport, Figure, Invariants};
use serde::{Deserialize, Serialize};

/// A run that ended, and whether it solves the scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Played {
    /// The case's figure; without a value if that is not finite, because JSON has no infinities.
    pub error: Figure,
    /// Its checks.
    pub invariants: Invariants,
    /// The reason why it does not solve the scene, if so.
    pub trouble: Option<String>,
}

impl Played {
    /// From the report of a case.
    pub fn of(report: CaseReport) -> Self {
        let CaseReport { error, invariants, .. } = report;
        let trouble = trouble(&error, &invariants);
        let value = error.value.filter(|x| x.is_finite());
        Played { error: Figure { value, ..error }, invariants, trouble }
    }
}

/// The reason why a run that ended does not solve the scene, if there is one: numbers that are not finite,
/// steps that failed, a lost object, a broken bound, bodies sunk into each other, or an error beyond any use.
/// The difference from the engine's own fine run is no reason.
pub fn trouble(error: &Figure, invariants: &Invariants) -> Option<String> {
    if error.value.is_some_and(|x| !x.is_finite()) {
        return Some("not finite".into());
    }
    if let Some(bad) = invariants.newton_unconverged.filter(|n| *n > 0) {
        return Some(format!("{bad} steps failed"));
    }
    if invariants.held == Some(false) {
        return Some("object lost".into());
    }
    if let (Some(part), Some(bound)) =
        (invariants.overlap_of_bound.filter(|part| *part > 1.0), invariants.overlap_bound_mm)
    {
        return Some(format!("overlap {:.1} mm > {bound:.1} mm", part * bound));
    }
    let value = error.value.filter(|_| !error.from_own_fine_run)?;
    if let Some(most) = error.within {
        return (value > most).then(|| format!("more than {most} {}", error.unit));
    }
    (value.abs() > useless(&error.unit)).then(|| format!("error {:.2} {}", value.abs(), error.unit))
}

/// The error from which on a run is useless.
fn useless(unit: &str) -> f64 {
    match unit {
        "rad" => 0.2,
        "mm" => 30.0,
        percent if percent.starts_with('%') => 50.0,
        _ => f64::INFINITY,
    }
}
