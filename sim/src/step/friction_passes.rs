//! Friction of cables within a step: its bounds depend on the tensions of the same step.
//!
//! With the tensions of the last step, the friction of a cable that is wound in 0.4 s lags by 2 % at 8 ms. So the step is solved again
//! with the tensions of its solution, until both agree.

use super::solve::solve;
use super::work::Work;
use crate::model::Model;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;

/// Largest number of repeated solves. Two are enough while the same guides slide.
const PASSES: usize = 8;

/// Solves again until the bounds of friction are those of the step's own tensions; `tension` is that of the last step.
pub(super) fn settle(
    model: &Model,
    work: &mut Work,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut [f64],
    tension: &[f64],
) {
    let Some(hand) = model.hand() else { return };
    let h = model.config().step_s;
    let first = problem.rows - model.friction_rows();
    let mut passes = std::mem::take(&mut work.friction_passes);
    passes.begin(tension);
    for _ in 0..PASSES {
        let impulse = |row: usize| newton.row_impulse(problem, row) / h;
        passes.read((0..hand.tendons.len()).map(impulse), (first..problem.rows).map(|row| -impulse(row)));
        if !passes.improve(hand, &mut problem.row_terms[first..]) {
            break;
        }
        solve(model, work, problem, newton, v);
    }
    work.friction_passes = passes;
}
