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

/// The fastest spring turns its phase by no more than this in a substep, rad, ...
const LARGEST_PHASE: f64 = 0.02;

/// ... and the fastest link turns by no more than this: of a pendulum's period it costs 0.01 %.
const LARGEST_TURN: f64 = 0.09;

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
        // A count that changes spoils the rule's symmetry in time, and energy creeps away: powers of two, and as many as
        // were ever needed while nothing acted.
        let needed = ((h * self.fastest_rate()).ceil().clamp(1.0, 1e6) as u32).next_power_of_two();
        let parts = needed.max(self.state.substeps);
        self.state.substeps = parts;
        let stride = Stride { h: h / f64::from(parts), theta: 0.5 };
        let mut mean = self.state.v[..n].to_vec();
        for _ in 0..parts {
            if !self.midpoint_substep(island, problem, newton, v, &mut mean, stride) {
                self.state.substeps = 0;
                (self.state.base, self.state.q) = (before.0, before.1);
                self.state.v[..n].copy_from_slice(&before.2);
                hand_dynamics(&self.model, &mut self.work, self.state.base, &self.state.q, &self.state.v);
                return false;
            }
        }
        true
    }

    /// Substeps a second that the highest natural frequency `√(E/M)` of a joint by itself, or the fastest turning
    /// link, asks for.
    fn fastest_rate(&self) -> f64 {
        let Some(hand) = self.model.hand() else { return 0.0 };
        let n = self.model.hand_dofs();
        let natural = hand.coordinates.iter().enumerate().fold(0.0, |most: f64, (i, c)| {
            let k = 6 + i;
            most.max((c.stiffness / self.work.mass[k * n + k]).sqrt())
        });
        let turning =
            self.work.recursion.velocity.iter().fold(0.0, |most: f64, v| most.max(v.angular.length()));
        (natural / LARGEST_PHASE).max(turning / LARGEST_TURN)
    }

    /// The unknown is the mean velocity v̄ of the substep; mass matrix and bias are those of the configuration
    /// half a substep on, found by iteration. `mean` is a first guess of it, and becomes one for the next substep.
    fn midpoint_substep(
        &mut self,
        island: &Island,
        problem: &mut Problem,
        newton: &mut Newton,
        v: &mut Vec<f64>,
        mean: &mut [f64],
        stride: Stride,
    ) -> bool {
        let base = self.state.base;
        let mut middle = Vec::with_capacity(self.state.q.len());
        let mut last = f64::INFINITY;
        for _ in 0..self.model.config().max_iterations {
            middle.clear();
            middle.extend_from_slice(&self.state.q);
            let half = advanced(base, &mut middle, mean, stride.theta * stride.h);
            hand_dynamics(&self.model, &mut self.work, half, &middle, mean);
            self.pose_problem(island, problem, v, stride);
            self.minimise(problem, newton, v, RESIDUAL);
            let acts = |term: &AxisTerm| term.dof >= 6 && term.law.impulse(term.sign * v[term.dof]).0 != 0.0;
            let pulls = (0..problem.rows).any(|k| newton.row_impulse(problem, k) != 0.0);
            if pulls || problem.axis_terms.iter().any(acts) {
                return false;
            }
            let change = v.iter().zip(&*mean).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            mean.copy_from_slice(v);
            // The next iteration would change it by as much less as this one did.
            let left = if last.is_finite() && change < last { change * (change / last) } else { change };
            last = change;
            if stride.h * left <= SETTLED {
                self.report_hand_forces(island, problem, newton, mean, stride.h);
                self.state.base = advanced(base, &mut self.state.q, mean, stride.h);
                for (v, mean) in self.state.v.iter_mut().zip(mean) {
                    let way = (*mean - *v) / stride.theta;
                    *v += way;
                    *mean = *v + stride.theta * way;
                }
                return true;
            }
        }
        false
    }
}
