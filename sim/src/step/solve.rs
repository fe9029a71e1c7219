//! Solves an island's problem within the remaining budget of the step.

use super::work::Work;
use crate::bounds::{Fault, step_iterations, step_work};
use crate::model::Model;
use crate::solver::newton::{Newton, Stop};
use crate::solver::problem::Problem;

/// Minimises from `v` on, and counts the computing.
pub(super) fn solve(
    model: &Model,
    work: &mut Work,
    problem: &mut Problem,
    newton: &mut Newton,
    v: &mut [f64],
) {
    let config = model.config();
    let Work { outcome, fault, dynamics, .. } = work;
    let stop = Stop {
        tolerance: config.tolerance,
        max_iterations: step_iterations(config.max_iterations, problem.objects.len()),
        max_work: step_work(model.objects().len()).saturating_sub(outcome.work),
    };
    let report = newton.solve(model, &dynamics.kin, problem, v, &stop);
    outcome.work += report.work;
    if report.unsolvable {
        *fault = Some(Fault::Unsolvable);
    }
    outcome.iterations = outcome.iterations.max(report.iterations);
    outcome.evaluations += report.evaluations;
    outcome.converged &= report.converged;
}
