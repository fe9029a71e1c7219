//! The second-order backward differentiation formula for a hand that touches nothing.
//!
//! `(3 x₁ − 4 x₀ + x₋₁)/(2 h) = f(x₁)` is a step of implicit Euler over `2 h/3` from the point `(4 x₀ − x₋₁)/3`. It
//! damps what is stiff as Euler does, so that no finger rings, and its error is of the second order.

use super::free::turned;
use crate::actuation::base::shortest_turn;
use crate::dynamics::pattern::{columns, row_sum};
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::AxisTerm;
use crate::state::Earlier;
use crate::world::World;
use palmares_models::Pose;

/// The part of the last step's way that the point of departure lies ahead.
const AHEAD: f64 = 1.0 / 3.0;

/// A third of what a force gives in a step arrives with the next one. Where the acceleration changes, energy is that much
/// early or late: a step in which it would be more than this, J, is Euler's.
const LATE_J: f64 = 1e-5;

/// Where no coordinate is faster, m/s or rad/s, the hand comes to rest, and its steps are Euler's: a pushed fingertip of
/// the ReFlex ended 1.16e-9 rad from its equilibrium with this formula, and less than 1e-9 rad with Euler's.
const AT_REST: f64 = 1e-6;

impl World {
    /// Steps a hand that touches nothing, and did not in the step before. False, and nothing done, when a contact or a
    /// limit acts or the motion is not smooth: what sets in with a jump is Euler's.
    pub(super) fn smooth_step(
        &mut self,
        island: &Island,
        problem: &mut Problem,
        newton: &mut Newton,
        v: &mut Vec<f64>,
    ) -> bool {
        let n = self.model.hand_dofs();
        let rests = self.state.v[..n].iter().all(|v| v.abs() < AT_REST);
        if rests || !(self.state.earlier.smooth && self.work.servo_on) {
            return false;
        }
        let mut now = std::mem::take(&mut self.work.now);
        self.write_hand(&mut now);
        let state = &mut self.state;
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
        let h = (1.0 - AHEAD) * self.model.config().step_s;
        self.pose_problem(island, problem, v, h);
        let first = if problem.held { 6 } else { 0 };
        v[first..n].copy_from_slice(&now.v[first..]);
        self.minimise(problem, newton, v, self.model.config().tolerance);
        let limited = |term: &AxisTerm| term.dof >= 6 && term.law.impulse(term.sign * v[term.dof]).0 != 0.0;
        let late = self.late_energy(v, &now.v);
        let touches = problem.points.iter().any(|point| point.impulse[2] > 0.0);
        let rough = touches || problem.axis_terms.iter().any(limited) || late > LATE_J;
        if rough {
            self.state.base = now.base;
            self.state.q.copy_from_slice(&now.q);
            self.state.v[..n].copy_from_slice(&now.v);
        } else {
            self.remember(island, problem);
            self.report_hand_forces(island, problem, newton, v, h);
            self.move_hand(v, h);
            std::mem::swap(&mut self.state.earlier, &mut now);
            self.state.earlier.smooth = true;
        }
        self.work.now = now;
        !rough
    }

    /// Energy that the change of the acceleration brings early or late, J.
    fn late_energy(&mut self, after: &[f64], now: &[f64]) -> f64 {
        let (n, before) = (self.model.hand_dofs(), &self.state.earlier.v);
        let change = &mut self.work.change;
        change.clear();
        change.extend(
            after.iter().zip(now).zip(before).map(|((after, now), before)| after - 2.0 * now + before),
        );
        let clusters = &self.model.clusters()[..self.model.hand_clusters()];
        let mut power = 0.0;
        for (block, cluster) in clusters.iter().enumerate() {
            let columns = columns(clusters, block, n);
            for i in cluster.dofs.clone() {
                power += after[i] * row_sum(&self.work.mass[i * n..][..n], change, &columns);
            }
        }
        power.abs() * AHEAD
    }

    /// Copies the hand's present pose and velocities.
    pub(super) fn write_hand(&self, to: &mut Earlier) {
        let state = &self.state;
        to.base = state.base;
        to.q.clear();
        to.q.extend_from_slice(&state.q);
        to.v.clear();
        to.v.extend_from_slice(&state.v[..self.model.hand_dofs()]);
    }
}
