//! Everything elastic that acts on several joints, as rows of the problem: tendons, then springs across joints, then the three
//! components of every pin, then dry friction.
//!
//! Rows are taken at the start of the step, so that a hand at rest is in the exact equilibrium of its lengths.

use super::row::row;
use super::{friction, tendon};
use crate::solver::terms::{RowTerm, ScalarLaw};
use crate::state::State;
use palmares_models::Vec3;
use palmares_models::hand::Hand;

/// Axes of the base frame, in which the gap of a pin is measured.
const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// Number of rows of a hand without those of dry friction.
pub fn rows(hand: &Hand) -> usize {
    hand.tendons.len() + hand.springs.len() + AXES.len() * hand.linkages.len()
}

/// Writes the rows for a step of h, in which the motors move for `step_s`; `terms` keeps them from step to step, and with them their sparsity. `stiffen` receives (coordinate, stiffness)
/// of the geometric stiffness: the positive part on the diagonal, so that the problem stays convex. Taken implicitly, it
/// damps the motion of one step and leaves forces at rest unchanged.
pub(crate) fn terms(
    hand: &Hand,
    state: &State,
    h: f64,
    step_s: f64,
    terms: &mut Vec<RowTerm>,
    mut stiffen: impl FnMut(usize, f64),
) {
    let rubbing = state.friction.len();
    if terms.len() != rows(hand) + rubbing {
        terms.clear();
        terms.extend(hand.tendons.iter().map(tendon::empty_row));
        terms.extend(hand.springs.iter().map(|spring| row(&spring.arms)));
        for pin in &hand.linkages {
            let zero: Vec<(usize, f64)> =
                pin.at(hand, &state.q).gradient.iter().map(|&(c, _)| (c, 0.0)).collect();
            terms.extend(AXES.map(|_| row(&zero)));
        }
        terms.extend(friction::empty_rows(hand));
    }
    let (terms, of_friction) = terms.split_at_mut(rows(hand));
    let (tendons, others) = terms.split_at_mut(hand.tendons.len());
    tendon::terms(hand, state, h, step_s, tendons);
    tendon::geometric_stiffness(hand, &state.q, &state.tension, &mut stiffen);
    if rubbing > 0 {
        friction::terms(hand, tendons, h, (&state.tension, &state.friction), of_friction);
    }
    if others.is_empty() {
        return;
    }
    let (springs, pins) = others.split_at_mut(hand.springs.len());
    for (term, spring) in springs.iter_mut().zip(&hand.springs) {
        term.law = both_ways(h, spring.stiffness, spring.damping, -spring.stretch(&state.q));
    }
    for (terms, pin) in pins.chunks_exact_mut(AXES.len()).zip(&hand.linkages) {
        let gap = pin.at(hand, &state.q);
        for (term, axis) in terms.iter_mut().zip(AXES) {
            for (entry, (_, change)) in term.row.iter_mut().zip(&gap.gradient) {
                entry.1 = axis.dot(*change);
            }
            term.law = both_ways(h, pin.stiffness, pin.damping, -axis.dot(gap.gap));
        }
        gap.curvature(gap.gap * pin.stiffness, |row, column, stiffness| {
            if row == column && stiffness > 0.0 {
                stiffen(row, stiffness);
            }
        });
    }
}

/// A spring and damper without a limit; `error` is rest minus length.
fn both_ways(h: f64, stiffness: f64, damping: f64, error: f64) -> ScalarLaw {
    ScalarLaw::Servo { h, stiffness, damping, error, target: 0.0, limit: f64::INFINITY }
}

/// Subtracts the torques of springs across joints and of pins at coordinates q from `tau`, one entry a coordinate.
pub(crate) fn subtract_torques(hand: &Hand, q: &[f64], tau: &mut [f64]) {
    for spring in &hand.springs {
        let force = spring.stiffness * spring.stretch(q);
        spring.arms.iter().for_each(|&(c, arm)| tau[c] -= arm * force);
    }
    for pin in &hand.linkages {
        let gap = pin.at(hand, q);
        let force = gap.gap * pin.stiffness;
        gap.gradient.iter().for_each(|&(c, change)| tau[c] -= change.dot(force));
    }
}
