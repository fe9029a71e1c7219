//! The second-order backward differentiation formula (BDF2) for a hand without contact.
//!
//! `(3 x₁ − 4 x₀ + x₋₁)/(2 h) = f(x₁)` (Curtiss and Hirschfelder 1952) is a step of implicit Euler over `2 h/3` from the point
//! `(4 x₀ − x₋₁)/3`. It damps stiff motion as Euler does, so that no finger rings, and its error is of second
//! order. It lags a change of force by a third of a step; implicit Euler takes steps whose energy error would
//! exceed [`LATE_J`].

use super::assemble::assemble;
use super::method::Attempt;
use super::solve::solve;
use super::torque_free::turned;
use super::work::Work;
use super::{contact_memory, integrate, joining};
use crate::actuation::base::shortest_turn;
use crate::actuation::slowed;
use crate::dynamics::pattern::{columns, row_sum};
use crate::model::Model;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::AxisTerm;
use crate::state::{HandMotion, State};
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
    pub(super) now: HandMotion,
    /// The point from which the step of implicit Euler goes.
    ahead: HandMotion,
    /// Change of the velocities beyond the change in the step before.
    change: Vec<f64>,
    /// Way of the step over its length.
    way: Vec<f64>,
}

/// Steps a hand that has no contact, and had none in the step before. Declines when a contact or a limit acts or the motion is not
/// smooth: implicit Euler takes steps with jumps.
pub(super) fn step(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    history: &mut History,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
) -> Attempt {
    let n = model.hand_dofs();
    if rests(&state.v[..n]) || !(state.earlier.smooth && work.drive.servo_on) {
        return Attempt::Declined;
    }
    history.now.read(state, n);
    extrapolate(&state.earlier.motion, &history.now, &mut history.ahead);
    history.ahead.write(state);
    let h = (1.0 - AHEAD) * model.config().step_s;
    assemble(&work.input(model, state), island, h, problem, v);
    let first = if problem.bolted { 6 } else { 0 };
    v[first..n].copy_from_slice(&history.now.v[first..]);
    solve(model, work, problem, newton, v);
    if jumps(problem, v)
        || late_energy(model, &work.dynamics.mass, v, &state.earlier.motion, history) > LATE_J
        || lands(model, state, work, island, v, history)
    {
        history.now.write(state);
        return Attempt::Declined;
    }
    let Work { collision, forces, impacts, drive, .. } = work;
    let impacts = &mut impacts.of_objects;
    contact_memory::remember(model, collision, island, problem, &mut state.pairs, impacts, forces);
    forces.read_hand(problem, newton, v, h, (&mut state.tension, &mut state.friction));
    integrate::move_hand(model, state, drive.bolted, v, h);
    slowed::follow(model, problem, newton, state);
    std::mem::swap(&mut state.earlier.motion, &mut history.now);
    Attempt::Taken
}

/// Whether the hand reaches a contact that the search has left out. Its way in the step is `h (2 v + v₀)/3`, up to the second order.
fn lands(
    model: &Model,
    state: &State,
    work: &mut Work,
    island: &Island,
    v: &[f64],
    history: &mut History,
) -> bool {
    if joining::nothing_waits(model, island) {
        return false;
    }
    let History { now, way, .. } = history;
    way.clear();
    way.extend(v.iter().zip(&now.v).map(|(after, before)| (1.0 - AHEAD) * after + AHEAD * before));
    joining::hand_reaches(model, state, work, island, way, &now.v)
}

/// Whether the hand comes to rest.
fn rests(v: &[f64]) -> bool {
    v.iter().all(|v| v.abs() < AT_REST)
}

/// The point `x₀ + (x₀ − x₋₁)/3`, positions and velocities, from `before` and `now`; the base turns about the axis of its last turn.
fn extrapolate(before: &HandMotion, now: &HandMotion, ahead: &mut HandMotion) {
    let travel = (now.base.translation - before.base.translation) * AHEAD;
    let turn = shortest_turn(before.base.rotation, now.base.rotation) * AHEAD;
    ahead.base = Pose::from_parts(now.base.translation + travel, turned(now.base.rotation, turn));
    let each = |(now, before): (&f64, &f64)| now + (now - before) * AHEAD;
    ahead.q.clear();
    ahead.q.extend(now.q.iter().zip(&before.q).map(each));
    ahead.v.clear();
    ahead.v.extend(now.v.iter().zip(&before.v).map(each));
}

/// Whether a contact or a limit bears at the end of the step, with the solution `v` of `problem`.
fn jumps(problem: &Problem, v: &[f64]) -> bool {
    let limited = |term: &AxisTerm| term.dof >= 6 && term.law.impulse(term.sign * v[term.dof]).0 != 0.0;
    problem.points.iter().any(|point| point.impulse[2] > 0.0) || problem.axis_terms.iter().any(limited)
}

/// Energy that a change of the acceleration brings early or late, J: `|vᵀ M (v − 2 v₀ + v₋₁)| / 3` with the velocities `v` at the end
/// of the step, those at its start, and those of one step `before`; M is the hand's `mass` matrix.
fn late_energy(
    model: &Model,
    mass: &[f64],
    v: &[f64],
    before: &HandMotion,
    History { now, change, .. }: &mut History,
) -> f64 {
    let n = model.hand_dofs();
    change.clear();
    let velocities = v[..n].iter().zip(&now.v).zip(&before.v);
    change.extend(velocities.map(|((after, now), before)| after - 2.0 * now + before));
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

#[cfg(test)]
mod tests {
    use super::{AHEAD, HandMotion, extrapolate};
    use crate::{Command, Config, Model, State, World};
    use palmares_models::hand::Hand;
    use palmares_models::{Pose, Rotation, Vec3};

    /// From the point ahead, a step of implicit Euler over 2 h/3 is exact for constant velocity, and for constant acceleration in
    /// the velocities.
    #[test]
    fn the_point_ahead_makes_the_formula_of_second_order() {
        let (h, speed, spin, acceleration) = (0.01, 0.3, 2.0, 5.0);
        let at = |t: f64| HandMotion {
            base: Pose::from_parts(Vec3::X * (speed * t), Rotation::from_rotation_z(spin * t)),
            q: vec![speed * t],
            v: vec![acceleration * t],
        };
        let mut ahead = HandMotion::default();
        extrapolate(&at(-h), &at(0.0), &mut ahead);
        let (rest, end) = ((1.0 - AHEAD) * h, at(h));
        assert!((ahead.q[0] + rest * speed - end.q[0]).abs() < 1e-15);
        assert!((ahead.v[0] + rest * acceleration - end.v[0]).abs() < 1e-15);
        assert!((ahead.base.translation.x + rest * speed - end.base.translation.x).abs() < 1e-15);
        let turned = Rotation::from_rotation_z(rest * spin) * ahead.base.rotation;
        assert!(turned.dot(end.base.rotation) > 1.0 - 1e-15);
    }

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
