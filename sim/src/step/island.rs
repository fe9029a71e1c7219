//! Choice of the integrator for an island.

use super::scratch::Scratch;
use super::{bdf2, cash_karp, euler};
use crate::actuation::slowed;
use crate::model::Model;
use crate::solver::island::Island;
use crate::state::State;

/// Takes one step of an island; `slot` is the index of the solver that keeps its orderings. A hand without
/// contact is stepped by a method of higher order: an undamped one by [`cash_karp`], a damped one by
/// [`bdf2`]; neither if something rubs, because dry friction jumps. Implicit [`euler`] steps everything else, and the steps that these decline.
pub(super) fn step(model: &Model, state: &mut State, scratch: &mut Scratch, island: &Island, slot: usize) {
    if scratch.solvers.len() <= slot {
        scratch.solvers.resize_with(slot + 1, Default::default);
    }
    let Scratch { work, solvers, v, support, bdf2: history, cash_karp: stages, .. } = scratch;
    let alone = island.hand && island.objects.is_empty();
    let undamped = model.undamped_hand();
    if alone
        && undamped
        && island.pairs.is_empty()
        && cash_karp::step(model, state, work, stages.get_or_insert_default())
    {
        return;
    }
    let (problem, newton) = &mut solvers[slot];
    if !island.hand {
        euler::step(model, state, work, island, (problem, newton), v, support);
        return;
    }
    let smooth = !undamped && model.friction_rows() == 0;
    if alone && smooth && bdf2::step(model, state, work, history, island, (problem, newton), v) {
        slowed::follow(model, problem, newton, state);
        return;
    }
    let mut earlier = std::mem::take(&mut state.earlier);
    bdf2::copy_hand(model, state, &mut earlier);
    euler::step(model, state, work, island, (problem, newton), v, support);
    slowed::follow(model, problem, newton, state);
    let touches = problem.points.iter().any(|point| point.impulse[2] > 0.0);
    let smooth = smooth && alone && !touches && work.forces.limits.is_empty() && work.drive.servo_on;
    earlier.smooth = smooth;
    state.earlier = earlier;
}
