//! Scratch memory of a step: it carries nothing to the next except capacity, orderings and caches.

use super::bdf2::History;
use super::cash_karp::Stages;
use super::support_transfer::SupportTransfer;
use super::work::Work;
use crate::solver::island::Islands;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;

/// Scratch memory of a step, and the results of the last step.
#[derive(Default)]
pub(crate) struct Scratch {
    pub work: Work,
    /// Computing of the next step's dynamics and contacts, if they are prepared.
    pub prepared: Option<u64>,
    pub islands: Islands,
    /// One for all lone objects, then one for each other island, so that orderings are reused.
    pub solvers: Vec<(Problem, Newton)>,
    /// Generalized velocity of the island that is solved.
    pub v: Vec<f64>,
    pub support: SupportTransfer,
    pub bdf2: History,
    /// Boxed: moving a struct of a dozen vectors takes long.
    pub cash_karp: Option<Box<Stages>>,
}

impl Scratch {
    /// Discards everything known about a state that has been changed from outside.
    pub(crate) fn invalidate(&mut self) {
        self.work.fault = None;
        self.prepared = None;
        self.work.collision.invalidate();
    }
}
