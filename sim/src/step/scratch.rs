//! Memory of a step that carries nothing to the next, except capacity, orderings and what a cache may know.

use super::bdf2::History;
use super::cash_karp::Stages;
use super::support_transfer::SupportTransfer;
use super::work::Work;
use crate::solver::island::Islands;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;

/// Scratch memory of a step, and what the last step told of itself.
#[derive(Default)]
pub(crate) struct Scratch {
    pub work: Work,
    /// What the next step's dynamics and contacts took to compute, if they are known already.
    pub prepared: Option<u64>,
    pub islands: Islands,
    /// One for all lone objects, then one for each other island, so that orderings are re-used.
    pub solvers: Vec<(Problem, Newton)>,
    /// Generalized velocity of the island that is solved.
    pub v: Vec<f64>,
    pub support: SupportTransfer,
    pub bdf2: History,
    /// In a box: a struct of a dozen vectors takes long to move.
    pub cash_karp: Option<Box<Stages>>,
}

impl Scratch {
    /// Forgets what was known of a state that has been changed from outside.
    pub(crate) fn invalidate(&mut self) {
        self.work.fault = None;
        self.prepared = None;
        self.work.collision.invalidate();
    }
}
