//! Implicit Euler: `M (v₁ − v₀) = h f(x₀ + h v₁, v₁)`, forces and velocities of the end of the step. Stable for any
//! stiffness and contact; its error is of the first order.
//!
//! 1. [`solve_with_rebounds`]: the solution, with the speeds at which bodies rebound.
//! 2. [`passing::leave_out`]: surfaces that only pass each other.
//! 3. [`support_transfer::transfer`]: a lone object that tips onto another support.
//! 4. [`slip_passes::settle`]: where slip begins or ends, unless supports have changed.
//! 5. [`friction_passes::settle`]: cables that rub on their guides.
//! 6. [`joining::reached`]: contacts that the search has left out and the solution reaches join, and all is solved again.
//! 7. [`blow_energy::limit`]: blows add no energy.
//! 8. [`contact_memory::remember`]: anchors for the next step.
//! 9. [`move_hand`], [`integrate::move_objects`]: positions; those of a hand alone in second order ([`second_order`]).

use super::assemble::assemble;
use super::impacts::{Bodies, Rebounds};
use super::solve::solve;
use super::support_transfer::{self, SupportTransfer};
use super::work::Work;
use super::{blow_energy, contact_memory, friction_passes, impacts};
use super::{integrate, joining, known_blows, momentum, passing, second_order, slip_passes};
use crate::actuation::slowed;
use crate::bounds::step_work;
use crate::law::Law;
use crate::model::Model;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::state::State;

/// Steps an island.
pub(super) fn step(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    island: &mut Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
    support: &mut SupportTransfer,
) {
    // Every round but the last lets something join.
    loop {
        let rebounds = solve_with_rebounds(model, state, work, island, (problem, newton), v);
        // Bodies that rebound within the step do not move along their velocities at its end.
        if rebounds == Rebounds::Own
            && (island.is_lone_object() || !model.rebounds() || !impacts::any_within(&work.collision, island))
        {
            passing::leave_out(model, state, work, island, (problem, newton), v);
        }
        let transferred = support_transfer::transfer(model, work, island, (problem, newton), v, support);
        if !transferred {
            slip_passes::settle(model, work, island, (problem, newton), v);
        }
        if island.hand && !state.friction.is_empty() {
            friction_passes::settle(model, work, (problem, newton), v, &state.tension);
        }
        let spent = work.outcome.work > step_work(model.objects().len());
        if spent || !joining::reached(model, state, work, island, v) {
            break;
        }
    }
    blow_energy::limit(model, state, work, island, (problem, newton), v);
    let Work { collision, impacts, forces, .. } = work;
    let impacts = &mut impacts.of_objects;
    contact_memory::remember(model, collision, island, problem, &mut state.pairs, impacts, forces);
    if island.hand {
        move_hand(model, state, work, island, (problem, newton), v);
    }
    let in_second_order = integrate::move_objects(
        model,
        state,
        island,
        problem,
        v,
        (&work.collision.contacts, &work.loads),
        &mut work.impacts,
    );
    work.acted.insert_if(Law::ObjectOrder, in_second_order);
}

/// Solves the step with its rebounds.
fn solve_with_rebounds(
    model: &Model,
    state: &State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
) -> Rebounds {
    let Work { collision, impacts, outcome, loads, .. } = work;
    let bodies = Bodies { model, state, loads };
    let rebounds = impacts::find(bodies, &mut collision.contacts, island, impacts, &mut outcome.work);
    match rebounds {
        Rebounds::Sequence => impacts::follow_paths(model, collision, island, impacts),
        Rebounds::Own if model.rebounds() => {
            known_blows::note_single(bodies, &mut collision.contacts, island);
        }
        Rebounds::Own => {}
    }
    assemble(&work.input(model, state), island, model.config().step_s, problem, v);
    if model.rebounds() {
        known_blows::start(&work.collision.contacts, island, problem, v);
    }
    solve(model, work, problem, newton, v);
    rebounds
}

/// Moves the hand with the solution `v`: `q₁ = q₀ + h v₁`, or in second order ([`second_order`]). A hand that nothing holds keeps its
/// momentum ([`momentum`]).
fn move_hand(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &[f64],
) {
    let h = model.config().step_s;
    work.forces.read_hand(problem, newton, v, h, (&mut state.tension, &mut state.friction));
    let Work { dynamics, drive, collision, outcome, acted, second_order: correction, .. } = work;
    if second_order::applies(model, state, (drive.servo_on, &collision.contacts), island, problem, v) {
        let start = (&*dynamics, drive.pushes.as_slice(), &mut outcome.work);
        acted.insert(Law::HandOrder);
        second_order::move_hand(model, state, correction, start, (problem, newton), v);
        slowed::follow(model, problem, newton, state);
        return;
    }
    let due = (!drive.servo_on)
        .then(|| (momentum::due_after_step(model, dynamics, &drive.pushes, v), dynamics.kin.origin));
    integrate::move_hand(model, state, drive.bolted, v, h);
    if let Some((due, from)) = due {
        momentum::keep(model, state, dynamics, due, from);
    }
    slowed::follow(model, problem, newton, state);
}
