//! One step of an island: the integrator of the highest order that takes it.

use super::method::{Attempt, Method};
use super::scratch::Scratch;
use super::work::Work;
use super::{bdf2, cash_karp, euler, rolling};
use crate::law::Law;
use crate::model::Model;
use crate::solver::island::Island;
use crate::solver::problem::Problem;
use crate::state::State;

/// Takes one step of an island; `slot` is the index of the solver that keeps its orderings.
pub(super) fn step(
    model: &Model,
    state: &mut State,
    scratch: &mut Scratch,
    island: &mut Island,
    slot: usize,
) {
    if scratch.solvers.len() <= slot {
        scratch.solvers.resize_with(slot + 1, Default::default);
    }
    let Scratch { work, solvers, v, support, bdf2: history, cash_karp: stages, .. } = scratch;
    let (problem, newton) = &mut solvers[slot];
    let method = Method::of(model, island);
    let attempt = match method {
        Method::CashKarp => cash_karp::step(model, state, work, stages.get_or_insert_default()),
        Method::Bdf2 => bdf2::step(model, state, work, history, island, (problem, newton), v),
        Method::Euler if island.is_lone_object() => {
            rolling::step(model, state, work, island, (problem, newton), v)
        }
        Method::Euler => Attempt::Declined,
    };
    if attempt == Attempt::Taken {
        work.acted.insert(if island.hand { Law::HandOrder } else { Law::ObjectOrder });
        return;
    }
    if island.hand {
        history.now.read(state, model.hand_dofs());
    }
    euler::step(model, state, work, island, (problem, newton), v, support);
    if island.hand {
        std::mem::swap(&mut state.earlier.motion, &mut history.now);
        state.earlier.smooth = method == Method::Bdf2 && was_smooth(work, problem);
    }
}

/// Whether nothing jumped in a step of the hand: no contact and no limit bore, and the servo held the base. BDF2 may take the next
/// one.
fn was_smooth(work: &Work, problem: &Problem) -> bool {
    let touches = problem.points.iter().any(|point| point.impulse[2] > 0.0);
    !touches && work.forces.limits.is_empty() && work.drive.servo_on
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Command;
    use crate::config::Config;
    use crate::step::{actuate, prepare};
    use palmares_models::Pose;
    use palmares_models::hand::Hand;

    /// The SoftHand with a slack tendon, its first motion prepared; `damped` or not.
    fn flying(damped: bool, change: fn(&Model, &mut State)) -> (Model, State, Scratch, Island) {
        let mut hand = Hand::clone(&Hand::builtin("softhand").expect("built in"));
        hand.motors.iter_mut().for_each(|motor| motor.offset = 10.0);
        if !damped {
            hand.coordinates.iter_mut().for_each(|coordinate| coordinate.damping = 0.0);
            hand.tendons.iter_mut().for_each(|tendon| tendon.damping = 0.0);
        }
        let model = Model::new(Config::with_step(1e-3), Some(hand.into())).expect("a hand");
        let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
        state.earlier.motion.read(&state.clone(), model.hand_dofs());
        state.earlier.smooth = true;
        change(&model, &mut state);
        let mut scratch = Scratch::default();
        prepare(&model, &mut state, &mut scratch, &mut ());
        actuate(&model, &mut state, &mut scratch.work.drive, &Command::stay(&model, Pose::IDENTITY));
        (model, state, scratch, Island { hand: true, ..Island::default() })
    }

    fn attempt((model, state, scratch, island): &mut (Model, State, Scratch, Island)) -> Attempt {
        let Scratch { work, v, bdf2: history, cash_karp: stages, .. } = scratch;
        let (mut problem, mut newton) = Default::default();
        match Method::of(model, island) {
            Method::Bdf2 => bdf2::step(model, state, work, history, island, (&mut problem, &mut newton), v),
            Method::CashKarp => cash_karp::step(model, state, work, stages.get_or_insert_default()),
            Method::Euler => panic!("a hand alone"),
        }
    }

    #[test]
    fn a_step_that_is_declined_after_it_was_solved_leaves_no_trace() {
        // A sudden speed; a finger that runs into its limit.
        let jump = |_: &Model, state: &mut State| state.v[6..].fill(3.0);
        let stop = |model: &Model, state: &mut State| {
            let limit = model.hand().expect("a hand").coordinates[0].upper;
            (state.q[0], state.v[6]) = (limit - 1e-3, 3.0);
        };
        for mut case in [flying(true, jump), flying(false, stop)] {
            let before = case.1.hash();
            assert_eq!(attempt(&mut case), Attempt::Declined);
            assert_eq!(case.1.hash(), before);
        }
    }
}
