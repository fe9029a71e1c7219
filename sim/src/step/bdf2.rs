//! The second-order backward differentiation formula (BDF2) for a hand without contact.
//!
//! `(3 x₁ − 4 x₀ + x₋₁)/(2 h) = f(x₁)` (Curtiss and Hirschfelder 1952) is a step of implicit Euler over `2 h/3` from the point
//! `(4 x₀ − x₋₁)/3`. It damps stiff motion as Euler does, so that no finger rings, and its error is of second
//! order. It lags a change of force by a third of a step; implicit Euler takes steps whose energy error would
//! exceed [`LATE_J`].

use super::assemble::assemble;
use super::solve::solve;
use super::torque_free::turned;
use super::work::Work;
use super::{contact_memory, integrate};
use crate::actuation::base::shortest_turn;
use crate::dynamics::pattern::{columns, row_sum};
use crate::model::Model;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::AxisTerm;
use crate::state::{Earlier, State};
use palmares_models::Pose;

/// Part of the last displacement by which the starting point is ahead: x₀ + ⅓ of it.
const AHEAD: f64 = 1.0 / 3.0;

/// A third of a force's effect in a step arrives with the next one. Where the acceleration changes, energy
/// arrives early or late by that much; if it would be more than this, J, implicit Euler takes the step.
const LATE_J: f64 = 1e-5;

/// Speed, m/s or rad/s, below which the hand comes to rest, and implicit Euler takes its steps: a pushed
/// fingertip of the ReFlex ended 1.16e-9 rad from its equilibrium with BDF2, and less than 1e-9 rad with
/// Euler.
const AT_REST: f64 = 1e-6;

/// Scratch memory of the method.
#[derive(Default)]
pub(crate) struct History {
    /// The hand at the start of the step.
    now: Earlier,
    /// Change of the velocities beyond the change in the step before.
    change: Vec<f64>,
}

/// Steps a hand that has no contact, and had none in the step before. Returns false without effect when a
/// contact or a limit acts or the motion is not smooth: implicit Euler takes steps with jumps.
pub(super) fn step(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    History { now, change }: &mut History,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
) -> bool {
    let n = model.hand_dofs();
    let rests = state.v[..n].iter().all(|v| v.abs() < AT_REST);
    if rests || !(state.earlier.smooth && work.drive.servo_on) {
        return false;
    }
    copy_hand(model, state, now);
    let earlier = &state.earlier;
    let travel = (now.base.translation - earlier.base.translation) * AHEAD;
    let turn = shortest_turn(earlier.base.rotation, now.base.rotation) * AHEAD;
    state.base = Pose::from_parts(now.base.translation + travel, turned(now.base.rotation, turn));
    for ((q, now), before) in state.q.iter_mut().zip(&now.q).zip(&earlier.q) {
        *q = now + (now - before) * AHEAD;
    }
    for ((v, now), before) in state.v[..n].iter_mut().zip(&now.v).zip(&earlier.v) {
        *v = now + (now - before) * AHEAD;
    }
    let h = (1.0 - AHEAD) * model.config().step_s;
    assemble(&work.input(model, state), island, h, problem, v);
    let first = if problem.bolted { 6 } else { 0 };
    v[first..n].copy_from_slice(&now.v[first..]);
    solve(model, work, problem, newton, v);
    let limited = |term: &AxisTerm| term.dof >= 6 && term.law.impulse(term.sign * v[term.dof]).0 != 0.0;
    change.clear();
    change.extend(
        v[..n]
            .iter()
            .zip(&now.v)
            .zip(&state.earlier.v)
            .map(|((after, now), before)| after - 2.0 * now + before),
    );
    let late = late_energy(model, &work.dynamics.mass, v, change);
    let touches = problem.points.iter().any(|point| point.impulse[2] > 0.0);
    if touches || problem.axis_terms.iter().any(limited) || late > LATE_J {
        state.base = now.base;
        state.q.copy_from_slice(&now.q);
        state.v[..n].copy_from_slice(&now.v);
        return false;
    }
    let Work { collision, forces, impacts, drive, .. } = work;
    let impacts = &mut impacts.of_objects;
    contact_memory::remember(model, collision, island, problem, &mut state.pairs, impacts, forces);
    forces.read_hand(problem, newton, v, h, (&mut state.tension, &mut state.friction));
    integrate::move_hand(model, state, drive.bolted, v, h);
    std::mem::swap(&mut state.earlier, now);
    state.earlier.smooth = true;
    true
}

/// Energy that a change of the acceleration brings early or late, J, at velocity `v`; `change` is the change
/// of the velocities beyond the change in the step before, and `mass` the hand's mass matrix.
fn late_energy(model: &Model, mass: &[f64], v: &[f64], change: &[f64]) -> f64 {
    let n = model.hand_dofs();
    let clusters = &model.clusters()[..model.hand_clusters()];
    let mut power = 0.0;
    for (block, cluster) in clusters.iter().enumerate() {
        let columns = columns(clusters, block, n);
        for i in cluster.dofs.clone() {
            power += v[i] * row_sum(&mass[i * n..][..n], change, &columns);
        }
    }
    power.abs() * AHEAD
}

/// Copies the hand's present pose and velocities.
pub(super) fn copy_hand(model: &Model, state: &State, to: &mut Earlier) {
    to.base = state.base;
    to.q.clear();
    to.q.extend_from_slice(&state.q);
    to.v.clear();
    to.v.extend_from_slice(&state.v[..model.hand_dofs()]);
}

#[cfg(test)]
mod tests {
    use crate::{Command, Config, Model, State, World};
    use palmares_models::Pose;
    use palmares_models::hand::Hand;

    /// Coordinates of the SoftHand's fingers with a slack tendon, 50 ms after release, in steps of h.
    fn springing_back(h: f64) -> Vec<f64> {
        let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
        hand.motors.iter_mut().for_each(|motor| motor.offset = 10.0);
        let model = Model::new(Config::with_step(h), Some(hand.into())).expect("a hand");
        let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
        state.q.iter_mut().for_each(|q| *q += 0.1);
        let mut world = World::new(model.into(), state);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        for _ in 0..(0.05 / h).round() as u32 {
            world.step(&command);
        }
        world.state().q.clone()
    }

    #[test]
    fn the_error_falls_with_the_square_of_the_step() {
        let fine = springing_back(6.25e-5);
        let [coarse, half] = [2e-3, 1e-3]
            .map(|h| springing_back(h).iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
        // Ratio 4 for a method of second order, 2 for implicit Euler.
        assert!(coarse / half > 3.0, "{coarse:e} {half:e}");
    }
}
