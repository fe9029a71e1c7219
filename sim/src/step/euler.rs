//! Implicit Euler: `M (v₁ − v₀) = h f(x₀ + h v₁, v₁)`, forces and velocities of the end of the step. Stable for any
//! stiffness and contact; its error is of the first order.

use super::assemble::assemble;
use super::solve::solve;
use super::support_transfer::{self, SupportTransfer};
use super::work::Work;
use super::{contact_memory, friction_passes, impacts, integrate, momentum, slip_correction};
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
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
    support: &mut SupportTransfer,
) {
    let config = model.config();
    let h = config.step_s;
    let Work { collision, impacts, outcome, .. } = work;
    let sequence = impacts::find(model, state, &mut collision.contacts, island, impacts, &mut outcome.work);
    assemble(&work.input(model, state), island, h, problem, v);
    solve(model, work, problem, newton, v);
    if sequence
        && !impacts::keep_sequence(model, state, &mut work.collision, island, problem, &mut work.impacts)
    {
        assemble(&work.input(model, state), island, h, problem, v);
        solve(model, work, problem, newton, v);
    }
    let transferred = support_transfer::transfer(model, work, island, (problem, newton), v, support);
    let alone = island.is_lone_object();
    // The loop terminates: after the last pass there is no tolerance left.
    for pass in 0.. {
        // The lag covers slip that changes evenly, for contacts of any stiffness. Later passes are for
        // rebounds only.
        let finer = slip_correction::finer(config, pass);
        let is_over = transferred || finer.is_none() && !(alone && pass < slip_correction::REBOUND_PASSES);
        if is_over || !slip_correction::correct(config, &work.collision.contacts, island, problem, finer) {
            break;
        }
        solve(model, work, problem, newton, v);
    }
    if island.hand && !state.friction.is_empty() {
        friction_passes::settle(model, work, (problem, newton), v, &state.tension);
    }
    let Work { collision, impacts, forces, dynamics, drive, .. } = work;
    contact_memory::remember(
        model,
        collision,
        island,
        problem,
        &mut state.pairs,
        &mut impacts.of_objects,
        forces,
    );
    if island.hand {
        forces.read_hand(problem, newton, v, h, (&mut state.tension, &mut state.friction));
        let due = (!drive.servo_on)
            .then(|| (momentum::due_after_step(model, dynamics, &drive.pushes, v), dynamics.kin.origin));
        integrate::move_hand(model, state, drive.bolted, v, h);
        if let Some((due, from)) = due {
            momentum::keep(model, state, dynamics, due, from);
        }
    }
    integrate::move_objects(model, state, island, problem, v, &mut impacts.of_objects);
}
