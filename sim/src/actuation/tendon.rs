//! Tendons as solver terms: `f = clamp(K (s_ref − s(q) − h ṡ) − b ṡ, 0, f_max)`, `τ = R(q)ᵀ f`.
//!
//! R is taken at the start of the step, so a hand at rest is in the exact equilibrium of R(q).

use super::row::row;
use super::{clutch, slowed};
use crate::solver::driven::DrivenLaw;
use crate::solver::terms::{RowTerm, ScalarLaw};
use crate::state::State;
use palmares_models::hand::{Hand, Tendon};

/// The row of a tendon with its constant moment arms.
pub(super) fn empty_row(tendon: &Tendon) -> RowTerm {
    let mut arms: Vec<(usize, f64)> = tendon.coordinates().iter().map(|&c| (c, 0.0)).collect();
    for &(c, r) in &tendon.moment_arms {
        if let Some(entry) = arms.iter_mut().find(|entry| entry.0 == c) {
            entry.1 = r;
        }
    }
    row(&arms)
}

/// Writes law and varying moment arms of every tendon's row, for a step of h; the motors move for `step_s`.
pub(super) fn terms(hand: &Hand, state: &State, h: f64, step_s: f64, terms: &mut [RowTerm]) {
    let q = &state.q;
    for (k, (term, tendon)) in terms.iter_mut().zip(&hand.tendons).enumerate() {
        let mut s: f64 = tendon.moment_arms.iter().map(|&(c, r)| r * q[c]).sum();
        for element in &tendon.elements {
            let c = element.coordinate;
            let length = element.path.length(q[c]);
            s += length.value;
            let constant = tendon.moment_arms.iter().find(|arm| arm.0 == c).map_or(0.0, |arm| arm.1);
            if let Some(entry) = term.row.iter_mut().find(|entry| entry.0 == 6 + c) {
                entry.1 = constant + length.slope;
            }
        }
        let error = clutch::wound(hand, k, &state.motors, &state.locked) - s;
        let (stiffness, damping) = (tendon.stiffness, tendon.damping);
        let limit = slowed::most_held(hand, k, &state.motors);
        term.law = if let Some(drive) = slowed::of_tendon(hand, k, state, step_s) {
            ScalarLaw::Driven(DrivenLaw { h, stiffness, damping, error, drive })
        } else if tendon.both_ways {
            ScalarLaw::Servo { h, stiffness, damping, error, target: 0.0, limit }
        } else {
            ScalarLaw::Tendon { h, stiffness, damping, error, limit }
        };
    }
}

/// Geometric stiffness of tendons whose moment arm R depends on the joint: `−f dR/dq`, N·m/rad, from `τ(q + h
/// v) ≈ τ + h f R' v`. `add` receives (coordinate, stiffness) of the positive part only, so that the problem
/// stays convex. Taken implicitly, it damps the motion of one step and leaves forces at rest unchanged.
/// `tension` f is that of the last step, N.
pub(super) fn geometric_stiffness(hand: &Hand, q: &[f64], tension: &[f64], add: &mut impl FnMut(usize, f64)) {
    for (tendon, f) in hand.tendons.iter().zip(tension) {
        for element in &tendon.elements {
            let stiffness = -f * element.path.length(q[element.coordinate]).curvature;
            if stiffness > 0.0 {
                add(element.coordinate, stiffness);
            }
        }
    }
}
