//! Tendons as solver terms: `f = clamp(K (s_ref − s(q) − h ṡ) − b ṡ, 0, f_max)`, `τ = Rᵀ f`.

use super::motor::wound;
use crate::solver::terms::{RowTerm, ScalarLaw};
use crate::state::MotorState;
use palmares_models::hand::Hand;

/// Writes one term per tendon; `terms` keeps its rows from step to step.
pub fn terms(hand: &Hand, q: &[f64], motors: &[MotorState], h: f64, terms: &mut Vec<RowTerm>) {
    if terms.len() != hand.tendons.len() {
        terms.clear();
        terms.extend(hand.tendons.iter().map(|tendon| RowTerm {
            row: tendon.moment_arms.iter().map(|&(c, r)| (6 + c, r)).collect(),
            law: ScalarLaw::Limit { inverse_regularisation: 0.0, target: 0.0 },
        }));
    }
    for (term, tendon) in terms.iter_mut().zip(&hand.tendons) {
        let s: f64 = tendon.moment_arms.iter().map(|&(c, r)| r * q[c]).sum();
        term.law = ScalarLaw::Tendon {
            h,
            stiffness: tendon.stiffness,
            damping: tendon.damping,
            error: wound(&hand.motors[tendon.motor], motors[tendon.motor].position) - s,
            limit: tendon.force_limit,
        };
    }
}
