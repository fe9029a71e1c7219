//! Second order after a step of implicit Euler, for a hand that rubs or touches furniture.
//!
//! Implicit Euler, `u₁ = u₀ + h F(u₁)` with u = (q, v), takes too much energy from springs: `h² k v²/2` in each step. One sweep of
//! deferred correction with the trapezoidal rule (Dutt, Greengard, Rokhlin 2000) removes the error of first order:
//!
//! `(1 − Z) δ = −h/2 (F(u₁) − F(u₀))`, `u₁ + (1 + c Z)/(1 − Z)² δ`, `Z = h ∂F/∂u`
//!
//! The second factor keeps the scheme stable for any stiffness: it multiplies a mode of eigenvalue λ, z = h λ, by
//! `1/(1 − z) − z²/2 (1 + c z)/(1 − z)⁴`, which goes to 0 for stiff modes, and is at most 1 for every damped or undamped one if
//! c ≥ −23/12. Z has the matrix of the step. At rest δ is 0.
//!
//! The base moves as implicit Euler moves it. Friction that slides is a constant force over the step; where it turns round, the impulse of
//! the part before is added ([`laws`]). What sticks or bears is held: there the motion of implicit Euler stays. Bias forces and inertia
//! follow the corrected positions, as in the method of velocity Verlet ([`inertia`]).

mod inertia;
mod laws;

use super::integrate;
use crate::actuation::{clutch, friction};
use crate::command::Push;
use crate::contact::narrow_phase::Contacts;
use crate::dynamics::hand::HandDynamics;
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::linear::Linear;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::state::State;
use inertia::{Inertia, times};
use laws::{holds, linear, passes};
use palmares_models::hand::Hand;

/// c
const FILTER: f64 = -1.875;

/// Speed, m/s or rad/s, below which a hand is at rest.
const AT_REST: f64 = 1e-6;

/// Scratch memory of the correction.
#[derive(Default)]
pub(crate) struct SecondOrder {
    /// v₁ − v₀ of the joints.
    change: Vec<f64>,
    rows: Vec<Linear>,
    axes: Vec<Linear>,
    /// Implicit stiffness and damping of every coordinate, times the step: `h d + h² k`.
    implicit: Vec<f64>,
    /// δ of the positions, and of the velocities or, before a solve, the momenta.
    position: Vec<f64>,
    velocity: Vec<f64>,
    /// The first δ, filtered once.
    once: (Vec<f64>, Vec<f64>),
    force: Vec<f64>,
    inertia: Inertia,
}

/// Whether the hand's step of implicit Euler with the solution `v` is corrected: it is alone, moves, and rubs or touches furniture.
pub(super) fn applies(
    model: &Model,
    state: &State,
    (servo_on, contacts): (bool, &Contacts),
    island: &Island,
    problem: &Problem,
    v: &[f64],
) -> bool {
    let moves = |v: &[f64]| v[..model.hand_dofs()].iter().any(|v| v.abs() >= AT_REST);
    // Links that only bear on each other, as in every fist, do not pay for it.
    let touches = || {
        island.pairs.iter().zip(&problem.pairs).any(|(&index, solved)| {
            let pair = &contacts.pairs[index];
            [pair.a, pair.b].contains(&Owner::Static)
                && problem.points[solved.first..solved.end].iter().any(|point| point.impulse[2] > 0.0)
        })
    };
    island.objects.is_empty()
        && servo_on
        && model.has(Law::HandOrder)
        && (model.friction_rows() > 0 || touches())
        && (moves(&state.v) || moves(v))
}

/// Moves the hand with the solution `v` and its correction.
pub(super) fn move_hand(
    model: &Model,
    state: &mut State,
    own: &mut SecondOrder,
    (dynamics, pushes, spent): (&HandDynamics, &[Push], &mut u64),
    (problem, newton): (&mut Problem, &mut Newton),
    v: &[f64],
) {
    let (h, n) = (model.config().step_s, model.hand_dofs());
    let Some(hand) = model.hand() else { return };
    own.change.clear();
    own.change.extend(v[..n].iter().zip(&state.v).map(|(after, before)| after - before));
    own.inertia.begin(state, &own.change);
    let smooth = own.find_laws(model, hand, state, dynamics, (problem, newton), v);
    integrate::move_hand(model, state, problem.bolted, v, h);
    *spent += newton.factor_work();
    if smooth && newton.factor_held(model, &dynamics.kin, problem, (&own.rows, &own.axes)) {
        own.correct(model, hand, dynamics, (problem, newton), v);
        own.apply(state);
        own.inertia.follow(model, state, (dynamics, pushes), (problem, newton));
    }
}

impl SecondOrder {
    /// What every law does in the correction; holds points. False if a spring begins or ends to act: its step stays that of implicit Euler.
    fn find_laws(
        &mut self,
        model: &Model,
        hand: &Hand,
        state: &State,
        dynamics: &HandDynamics,
        (problem, newton): (&mut Problem, &mut Newton),
        v: &[f64],
    ) -> bool {
        let (h, n) = (model.config().step_s, model.hand_dofs());
        let mut smooth = true;
        self.change[..6].fill(0.0);
        newton.change_along(model, &dynamics.kin, problem, &self.change);
        self.implicit.clear();
        self.implicit.extend((6..n).map(|k| problem.hand_matrix[k * (n + 1)] - dynamics.mass[k * (n + 1)]));
        self.rows.clear();
        for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
            let rate = newton.row_velocity(k);
            let wound = if k < hand.tendons.len() {
                clutch::winding(hand, k, &state.motors, &state.locked, h)
            } else {
                0.0
            };
            let law = linear(&term.law, rate, newton.row_change(k), wound);
            smooth &= law.is_some();
            self.rows.push(law.unwrap_or_default());
        }
        let first = problem.rows - model.friction_rows();
        let Self { rows, force, .. } = self;
        force.clear();
        force.extend((first..problem.rows).map(|k| -newton.row_impulse(problem, k) / h));
        let tension = |k: usize| newton.row_impulse(problem, k) / h + rows[k].fall;
        friction::at_tensions(hand, tension, &problem.row_terms[first..], force);
        for (k, before) in (first..).zip(&*force) {
            rows[k].fall = -before - newton.row_impulse(problem, k) / h;
        }
        self.axes.clear();
        for term in &problem.axis_terms {
            let (rate, change) = (term.sign * v[term.dof], term.sign * self.change[term.dof]);
            let mut law = linear(&term.law, rate, change, 0.0).unwrap_or_default();
            law.held |= term.dof < 6 || passes(hand, state, term, 0.5 * h * (2.0 * rate - change));
            self.axes.push(law);
        }
        for k in 0..problem.points.len() {
            if let Some(tangents) = holds(&problem.points[k]) {
                newton.hold_point(problem, k, tangents);
            }
        }
        smooth
    }

    /// Finds the correction of positions and velocities.
    fn correct(
        &mut self,
        model: &Model,
        hand: &Hand,
        dynamics: &HandDynamics,
        (problem, newton): (&Problem, &mut Newton),
        v: &[f64],
    ) {
        let (h, n) = (model.config().step_s, model.hand_dofs());
        for buffer in [&mut self.position, &mut self.velocity, &mut self.force] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        // Half of the change of the velocities, without what is held.
        newton.multiply_free(model, problem, (&self.rows, &self.axes), &self.change, &mut self.position);
        newton.solve_held(problem, &mut self.position);
        self.position.iter_mut().for_each(|x| *x *= -0.5 * h);
        // Half of the change of the forces.
        for (k, coordinate) in hand.coordinates.iter().enumerate() {
            let (after, before) = (v[6 + k], v[6 + k] - self.change[6 + k]);
            self.velocity[6 + k] = 0.5 * (self.implicit[k] * after - h * coordinate.damping * before);
        }
        let Self { rows, axes, velocity, .. } = self;
        for (term, law) in problem.row_terms.iter().zip(&*rows) {
            term.row.iter().for_each(|&(i, r)| velocity[i] += 0.5 * h * law.fall * r);
        }
        for (term, law) in problem.axis_terms.iter().zip(&*axes) {
            velocity[term.dof] += 0.5 * h * law.fall * term.sign;
        }
        for (row, law) in self.rows.iter().enumerate().filter(|(_, law)| law.turn != 0.0) {
            // The response to a force for a time t: velocities F t, positions F t (h − t/2).
            let term = &problem.row_terms[row];
            self.force.fill(0.0);
            term.row.iter().for_each(|&(i, r)| self.force[i] = r);
            newton.solve_held(problem, &mut self.force);
            let after = newton.row_velocity(row);
            let before = after - newton.row_change(row);
            let time = h * before / (before - after - h * law.turn * term.apply(&self.force));
            let impulse = law.turn * time.clamp(0.0, h);
            term.row.iter().for_each(|&(i, r)| self.velocity[i] += r * impulse);
            self.position.iter_mut().zip(&self.force).for_each(|(x, u)| *x -= 0.5 * impulse * time * u);
        }
        self.solve(h, hand, (problem, newton));
        // With w = 1/(1 − Z) the filter is (1 + c) w² − c w.
        for pass in 0..2 {
            times(model, &dynamics.mass, &self.velocity, &mut self.force);
            std::mem::swap(&mut self.velocity, &mut self.force);
            self.solve(h, hand, (problem, newton));
            if pass == 0 {
                self.once.0.clone_from(&self.position);
                self.once.1.clone_from(&self.velocity);
            }
        }
        let mix = |(twice, once): (&mut f64, &f64)| *twice = (1.0 + FILTER) * *twice - FILTER * once;
        self.position.iter_mut().zip(&self.once.0).for_each(mix);
        self.velocity.iter_mut().zip(&self.once.1).for_each(mix);
    }

    /// Solves `(1 − Z) δ = (position, velocity)`, in which the velocities are momenta before.
    fn solve(&mut self, h: f64, hand: &Hand, (problem, newton): (&Problem, &mut Newton)) {
        let Self { rows, axes, implicit, position, velocity, .. } = self;
        for (k, coordinate) in hand.coordinates.iter().enumerate() {
            velocity[6 + k] -= (implicit[k] / h - coordinate.damping) * position[6 + k];
        }
        for (term, law) in problem.row_terms.iter().zip(&*rows).filter(|(_, law)| law.stiffness > 0.0) {
            let along = h * law.stiffness * term.apply(position);
            term.row.iter().for_each(|&(i, r)| velocity[i] -= r * along);
        }
        for (term, law) in problem.axis_terms.iter().zip(&*axes) {
            velocity[term.dof] -= h * law.stiffness * position[term.dof];
        }
        newton.solve_held(problem, velocity);
        position.iter_mut().zip(velocity).for_each(|(x, v)| *x += h * *v);
    }

    /// Adds the correction to a state at the end of the step.
    fn apply(&self, state: &mut State) {
        let add = |(to, by): (&mut f64, &f64)| *to += by;
        state.q.iter_mut().zip(&self.position[6..]).for_each(add);
        state.v.iter_mut().zip(&self.velocity).for_each(add);
    }
}
