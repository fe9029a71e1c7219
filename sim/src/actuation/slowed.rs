//! Motors that a load slows: their speed–torque line, power and largest force.
//!
//! A motor with one tendon of its own is part of the tendon's law ([`crate::solver::driven`]). One with several tendons, or at a
//! differential, moves before the step is solved, against the load that it would have if the joints went on at their present rates.

use super::clutch;
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
        let asked = (it.command - from).clamp(-reach, reach);
        let moved = if change == law.drive.wanted { asked } else { change / (weight * own.scaling) };
        it.position = (from + moved).clamp(0.0, 1.0);
        it.velocity = (it.position - from) / step_s;
    }
}

/// The part of a motor's `change` of σ that its load allows before a step; none of it for a motor that moves with the step's solution.
pub(crate) fn allowed(hand: &Hand, motor: usize, change: f64, state: &State, step_s: f64) -> f64 {
    let own = &hand.motors[motor];
    if !own.slows() {
        return change;
    }
    if (0..hand.tendons.len()).any(|k| hand.slowed_by(k).is_some_and(|(of, _)| of == motor)) {
        return 0.0;
    }
    let (mut stiffness, mut load, mut pulls, mut holds) = (0.0, 0.0, 0.0, None);
    for (k, tendon) in hand.tendons.iter().enumerate() {
        let weight = tendon.weight(motor);
        if weight == 0.0 {
            continue;
        }
        let mut rate = 0.0;
        tendon.gradient(&state.q, |c, arm| rate += arm * state.v[6 + c]);
        let wound = clutch::wound(hand, k, &state.motors, &state.locked);
        let stretch = wound - tendon.length(&state.q) - step_s * rate;
        let force = tendon.stiffness * stretch - tendon.damping * rate;
        load += weight * force.clamp(tendon.least_force(), tendon.most_held());
        stiffness += weight * weight * tendon.stiffness;
        pulls += weight.abs() * tendon.force_limit;
        if tendon.hold_limit.is_some() {
            holds = Some(f64::INFINITY);
        }
    }
    let stall = own.stall_force.unwrap_or(f64::INFINITY);
    let drive = Drive {
        wanted: own.scaling * change,
        reach: own.scaling.abs() * own.speed_limit * step_s,
        stall,
        work: own.power_limit.map_or(f64::INFINITY, |power| power * step_s),
        pulls: state.motors[motor].effort * stall.min(pulls),
        holds,
        both_ways: true,
    };
    if stiffness == 0.0 { change } else { drive.pull(stiffness, load).change / own.scaling }
}
