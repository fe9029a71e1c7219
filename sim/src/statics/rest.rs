//! A hand at rest, or the reason why none was found.

use super::equilibrium::NoEquilibrium;
use palmares_models::hand::Hand;

/// Method by which an equilibrium was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Closed form of adaptive synergies.
    ClosedForm,
    /// Newton's method, where the closed form does not hold.
    Newton,
}

/// Coordinates and tensions at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Equilibrium {
    /// q, rad or m.
    pub q: Vec<f64>,
    /// One per tendon, in its own unit.
    pub tension: Vec<f64>,
    /// Method.
    pub method: Method,
    /// Features outside the closed form: joints at limits, tendons slack or at limits, varying moment arms.
    pub beyond_closed_form: Vec<String>,
}

/// Reason why there is no prediction.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoPrediction {
    /// There is no stable equilibrium, or none was found.
    #[error(transparent)]
    NoEquilibrium(#[from] NoEquilibrium),
    /// A joint is unconstrained: nothing determines its position.
    #[error("joint '{0}' has no spring: where it rests depends on how it got there")]
    Loose(String),
    /// The search exceeded its budget.
    #[error("the search for the equilibrium exceeded its computing budget")]
    WorkExhausted,
    /// Joints reach limits and leave them in a cycle.
    #[error("joint limits, weight and pushes leave no equilibrium to iterate to")]
    Unsettled,
}

/// Subtracts work from the remaining budget.
pub(super) fn spend(left: &mut u64, work: u64) -> Result<(), NoPrediction> {
    *left = left.checked_sub(work).ok_or(NoPrediction::WorkExhausted)?;
    Ok(())
}

/// The tendons that are slack or at their limits.
pub(super) fn beyond_tendons(hand: &Hand, tension: &[f64]) -> impl Iterator<Item = String> {
    hand.tendons.iter().zip(tension).filter_map(|(t, &f)| {
        if f.abs() >= t.most_held() {
            Some(format!("tendon '{}' is at its limit of {}", t.name, t.most_held()))
        } else if f <= 0.0 && !t.both_ways {
            Some(format!("tendon '{}' is slack", t.name))
        } else {
            None
        }
    })
}
