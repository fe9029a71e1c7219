//! Scratch memory of a step that worlds of one hand can share.

use super::bdf2::History;
use super::cash_karp::Stages;
use super::scratch::Scratch;
use crate::dynamics::hand::HandDynamics;
use crate::model::Model;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use palmares_models::hand::Hand;
use std::sync::Arc;

/// Scratch memory that a thread lends to the worlds that it steps one after the other: it stays in the
/// processor's cache, while each world's own would have to be loaded again. It carries no result from world
/// to world. Its matrices have the pattern of one hand, that of the first world that borrows it: a world of
/// another hand, or with another number of objects, uses its own.
#[derive(Default)]
pub struct SharedScratch {
    lent_to: Option<(Arc<Hand>, usize)>,
    dynamics: HandDynamics,
    solvers: Vec<(Problem, Newton)>,
    v: Vec<f64>,
    bdf2: History,
    cash_karp: Option<Box<Stages>>,
}

impl Scratch {
    /// Exchanges it with that of a world of `model`; not between preparing a step and the step itself.
    pub(crate) fn exchange(&mut self, model: &Model, lent: &mut SharedScratch) {
        debug_assert!(self.prepared.is_none(), "the dynamics are those of a step that has been prepared");
        let Some(hand) = model.hand() else { return };
        let (first, objects) = lent.lent_to.get_or_insert_with(|| (hand.clone(), model.objects().len()));
        if !Arc::ptr_eq(first, hand) || *objects != model.objects().len() {
            return;
        }
        std::mem::swap(&mut self.work.dynamics, &mut lent.dynamics);
        std::mem::swap(&mut self.solvers, &mut lent.solvers);
        std::mem::swap(&mut self.v, &mut lent.v);
        std::mem::swap(&mut self.bdf2, &mut lent.bdf2);
        std::mem::swap(&mut self.cash_karp, &mut lent.cash_karp);
    }
}
