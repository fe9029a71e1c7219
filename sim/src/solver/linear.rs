//! Small changes about the solution of a step: a linear system with the matrix of the solution, in which rows, coordinates and contact
//! points may be held.

use super::friction_cone::ConeHessian;
use super::newton::Newton;
use super::problem::{Problem, multiply};
use crate::dynamics::tree::Kinematics;
use crate::model::Model;

/// Stiffness of what is held, as a multiple of the inertia that it holds.
const HELD: f64 = 1e6;

/// A scalar law about its solution.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Linear {
    /// Whether it is held.
    pub held: bool,
    /// Stiffness, N/m or N·m/rad.
    pub stiffness: f64,
    /// Force at the start of the step less that at its end.
    pub fall: f64,
    /// The same for friction that turns round within the step: the force before it does so less that after.
    pub turn: f64,
}

impl Newton {
    /// Changes of rates and of velocities of contact points with a `change` of the velocities of the hand: of rows they are in
    /// [`Self::row_change`], of points in [`super::problem::Point::change`].
    pub(crate) fn change_along(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &mut Problem,
        change: &[f64],
    ) {
        self.project(model, kin, problem, change, true);
    }

    /// Change of the rate of a row.
    pub(crate) fn row_change(&self, row: usize) -> f64 {
        self.row_direction[row]
    }

    /// Holds a point of the problem along its normal and, on request, along its tangents. Its law is lost.
    pub(crate) fn hold_point(&mut self, problem: &mut Problem, point: usize, tangents: bool) {
        let stiff = HELD * problem.hand_matrix[0];
        let law = &mut problem.points[point].law;
        (law.normal, law.tangential) = (stiff, if tangents { stiff } else { 0.0 });
        self.hessians[point] = ConeHessian::Stick;
    }

    /// Factors the matrix with held rows and axis terms. False if it has no factor.
    pub(crate) fn factor_held(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &Problem,
        (rows, axes): (&[Linear], &[Linear]),
    ) -> bool {
        for (k, term) in
            problem.row_terms.iter().enumerate().take(problem.rows).filter(|(k, _)| rows[*k].held)
        {
            let mobility: f64 = term.row.iter().map(|&(i, r)| r * r * self.inverse_diagonal[i]).sum();
            self.row_curvature[k] = if mobility > 0.0 { HELD / mobility } else { 0.0 };
        }
        for (k, term) in problem.axis_terms.iter().enumerate().filter(|(k, _)| axes[*k].held) {
            self.axis_curvature[k] = HELD / self.inverse_diagonal[term.dof];
        }
        self.assemble(model, kin, problem);
        self.cholesky.factor()
    }

    /// Computing of a factorisation, in the unit of [`crate::bounds`].
    pub(crate) fn factor_work(&self) -> u64 {
        self.cholesky.work()
    }

    /// `out = B x` with the matrix B without what holds.
    pub(crate) fn multiply_free(
        &self,
        model: &Model,
        problem: &Problem,
        (rows, axes): (&[Linear], &[Linear]),
        x: &[f64],
        out: &mut [f64],
    ) {
        multiply(model, problem, x, out);
        for (k, term) in
            problem.row_terms.iter().enumerate().take(problem.rows).filter(|(k, _)| !rows[*k].held)
        {
            let along = self.row_curvature[k] * term.apply(x);
            term.row.iter().for_each(|&(i, r)| out[i] += r * along);
        }
        for (k, term) in problem.axis_terms.iter().enumerate().filter(|(k, _)| !axes[*k].held) {
            out[term.dof] += self.axis_curvature[k] * x[term.dof];
        }
    }

    /// Replaces the right side `x` by the solution, without a motion of the base, which has to be held.
    pub(crate) fn solve_held(&mut self, problem: &Problem, x: &mut [f64]) {
        self.rhs.clear();
        self.rhs.extend_from_slice(x);
        self.rhs[..6].fill(0.0);
        self.rhs.resize(x.len() + problem.rows, 0.0);
        self.cholesky.solve(&mut self.rhs, &mut self.scratch);
        x.copy_from_slice(&self.rhs[..x.len()]);
        x[..6].fill(0.0);
    }
}
