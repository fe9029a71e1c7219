//! The implicit midpoint rule for a hand that loses no energy.

use super::free::advanced;
use super::hand_dynamics;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::AxisTerm;
use crate::world::World;

/// How far a solve goes, and when in it forces act.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stride {
    /// Length h, s.
    pub h: f64,
    /// 1: implicit Euler, forces of the end. ½: midpoint rule.
    pub theta: f64,
}

/// The midpoint rule is content when its configuration moves less than this in an iteration, m or rad.
const SETTLED: f64 = 1e-12;

/// ... and its linear solves leave this relative residual: what they leave would be drift.
const RESIDUAL: f64 = 1e-12;

/// The fastest spring turns its phase, and the fastest link turns, by no more than this in a substep, rad.
const LARGEST_TURN: f64 = 0.02;

impl World {
    /// Steps a hand without dampers that touches nothing by the implicit midpoint rule, which keeps its energy;
    /// implicit Euler would damp the springs. The rule is symmetric in time, so that its error does not grow;
    /// substeps keep it small. False, and nothing done, when a tendon or a limit acts.
    pub(super) fn conservative_step(
        &mut self,
        island: &Island,
        problem: &mut Problem,
        newton: &mut Newton,
        v: &mut Vec<f64>,
    ) -> bool {
        let n = self.model.hand_dofs();
        let h = self.model.config().step_s;
        let before = (self.state.base, self.state.q.clone(), self.state.v[..n].to_vec());
        // Powers of two: a count that changes all the time would spoil the rule's symmetry in time.
        let parts =
            ((h * self.fastest_rate() / LARGEST_TURN).ceil().clamp(1.0, 1e6) as u32).next_power_of_two();
        let stride = Stride { h: h / f64::from(parts), theta: 0.5 };
        for _ in 0..parts {
            if !self.midpoint_substep(island, problem, newton, v, stride) {
                (self.state.base, self.state.q) = (before.0, before.1);
                self.state.v[..n].copy_from_slice(&before.2);
                hand_dynamics(&self.model, &mut self.work, self.state.base, &self.state.q, &self.state.v);
                return false;
            }
        }
        true
    }

    /// The highest natural frequency `√(E/M)` of a joint by itself, or the fastest turning link, rad/s.
    fn fastest_rate(&self) -> f64 {
        let Some(hand) = self.model.hand() else { return 0.0 };
        let n = self.model.hand_dofs();
        let natural = hand.coordinates.iter().enumerate().fold(0.0, |most: f64, (i, c)| {
            let k = 6 + i;
            most.max((c.stiffness / self.work.mass[k * n + k]).sqrt())
        });
        self.work.recursion.velocity.iter().fold(natural, |most, v| most.max(v.angular.length()))
    }

    /// The unknown is the mean velocity v̄ of the substep; mass matrix and bias are those of the configuration
    /// half a substep on, found by iteration.
    fn midpoint_substep(
        &mut self,
        island: &Island,
        problem: &mut Problem,
        newton: &mut Newton,
        v: &mut Vec<f64>,
        stride: Stride,
    ) -> bool {
        let n = self.model.hand_dofs();
        let (base, q) = (self.state.base, self.state.q.clone());
        let mut mean = self.state.v[..n].to_vec();
        for _ in 0..self.model.config().max_iterations {
            let mut middle = q.clone();
            let half = advanced(base, &mut middle, &mean, stride.theta * stride.h);
            hand_dynamics(&self.model, &mut self.work, half, &middle, &mean);
            self.pose_problem(island, problem, v, stride);
            self.minimise(problem, newton, v, RESIDUAL);
            let acts = |term: &AxisTerm| term.dof >= 6 && term.law.impulse(term.sign * v[term.dof]).0 != 0.0;
            let pulls = (0..problem.rows).any(|k| newton.row_impulse(problem, k) != 0.0);
            if pulls || problem.axis_terms.iter().any(acts) {
                return false;
            }
            let change = v.iter().zip(&mean).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            mean.copy_from_slice(v);
            if stride.h * change <= SETTLED {
                self.report_hand_forces(island, problem, newton, &mean, stride.h);
                self.state.base = advanced(base, &mut self.state.q, &mean, stride.h);
                for (v, mean) in self.state.v[..n].iter_mut().zip(&mean) {
                    *v += (mean - *v) / stride.theta;
                }
                return true;
            }
        }
        false
    }
}
