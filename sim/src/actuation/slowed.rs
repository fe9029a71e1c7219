//! Motors that a load slows: their speed–torque line, power and largest force.
//!
//! Such a motor has one tendon of its own, and is part of the tendon's law ([`crate::solver::driven`]): it moves with the solution of
//! the step.

use crate::model::Model;
use crate::solver::driven::Drive;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::ScalarLaw;
use crate::state::{MotorState, State};
use palmares_models::hand::{Hand, Tendon};

/// The motor that is part of the law of a tendon.
pub(super) fn of_tendon(hand: &Hand, tendon: usize, state: &State, step_s: f64) -> Option<Drive> {
    let (motor, weight) = hand.slowed_by(tendon)?;
    let (own, it, tendon) = (&hand.motors[motor], &state.motors[motor], &hand.tendons[tendon]);
    let winds = weight * own.scaling;
    let reach = own.speed_limit * step_s;
    let stall = own.stall_force.map_or(f64::INFINITY, |stall| stall / weight.abs());
    Some(Drive {
        wanted: winds * (it.command - it.position).clamp(-reach, reach),
        reach: winds.abs() * reach,
        stall,
        work: own.power_limit.map_or(f64::INFINITY, |power| power * step_s),
        pulls: it.effort * tendon.force_limit.min(stall),
        holds: tendon.hold_limit,
        both_ways: tendon.both_ways,
    })
}

/// Largest force of a tendon: what it holds, or what its motors pull with now. The weakest motor of a differential decides.
pub(crate) fn most_held(hand: &Hand, tendon: usize, motors: &[MotorState]) -> f64 {
    let tendon = &hand.tendons[tendon];
    tendon.hold_limit.unwrap_or_else(|| tendon.force_limit * effort(tendon, motors))
}

/// Part of its largest force that the motors of a tendon may use.
pub(crate) fn effort(tendon: &Tendon, motors: &[MotorState]) -> f64 {
    tendon.motors.iter().fold(1.0, |least, &(motor, _)| least.min(motors[motor].effort))
}

/// Moves the motors that are part of their tendons' laws; `newton` has the solution of `problem`.
pub(crate) fn follow(model: &Model, problem: &Problem, newton: &Newton, state: &mut State) {
    let Some(hand) = model.hand() else { return };
    let step_s = model.config().step_s;
    for (k, term) in problem.row_terms.iter().enumerate().take(hand.tendons.len()) {
        let (ScalarLaw::Driven(law), Some((motor, weight))) = (&term.law, hand.slowed_by(k)) else {
            continue;
        };
        let (own, it) = (&hand.motors[motor], &mut state.motors[motor]);
        let change = law.pull(newton.row_velocity(k)).change;
        let from = it.position;
        let reach = own.speed_limit * step_s;
        let requested = (it.command - from).clamp(-reach, reach);
        let moved = if change == law.drive.wanted { requested } else { change / (weight * own.scaling) };
        it.position = (from + moved).clamp(0.0, 1.0);
        it.velocity = (it.position - from) / step_s;
    }
}
