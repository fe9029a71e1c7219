//! Newton's method on one island, with exact line search.
//!
//! Contacts enter through the relative spatial velocity of their two bodies. A pair of bodies contributes one
//! 6x6 matrix `K = Σ Wᵀ G W`, independent of its number of points, and K on a link adds up down the tree
//! exactly as inertia does in the composite-rigid-body algorithm: `H = Sᵀ K S` costs as much as a mass
//! matrix, not as much as all contact Jacobians.

use super::friction_cone::ConeHessian;
use super::problem::{PairBody, Point, Problem, multiply};
pub use super::workspace::Newton;
use crate::bounds::{POINT_WORK, hand_work};
use crate::dynamics::spatial::{Force, SpatialVelocity};
use crate::dynamics::tree::Kinematics;
use crate::model::Model;
use palmares_models::Vec3;

/// The line search stops when the slope is this part of its first value: the full step is nearly always good
/// enough.
const LINE_TOLERANCE: f64 = 0.5;

/// Number of iterations after which the line search becomes finer.
const MANY_ITERATIONS: usize = 8;

/// Tolerance of this finer line search.
const FINE_LINE_TOLERANCE: f64 = 1e-3;

/// An island whose residual starts below this counts as at rest.
const AT_REST: f64 = 1e-3;

/// Factor on the tolerance for islands at rest.
const REST_TOLERANCE: f64 = 0.1;

/// Stopping criteria of a solve.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Norm of the gradient relative to the momenta at which the solve has converged.
    pub tolerance: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// Largest computing, in the unit of [`crate::bounds`].
    pub max_work: u64,
}

/// Statistics of a solve.
#[derive(Clone, Copy, Debug, Default)]
pub struct SolveReport {
    /// Newton iterations.
    pub iterations: usize,
    /// Line search evaluations.
    pub evaluations: usize,
    /// Relative norm of the gradient at the end.
    pub residual: f64,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// Whether the matrix is not positive definite, so that there is no solution.
    pub unsolvable: bool,
    /// Computing of the solve, in the unit of [`crate::bounds`].
    pub work: u64,
}

impl Newton {
    /// Minimises over `v`, which holds the start and then the solution. Impulses stay in the problem's
    /// points; [`Newton::row_impulse`] returns those of tendons. The solve may end without a solution, see
    /// [`Stop`].
    pub fn solve(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &mut Problem,
        v: &mut [f64],
        stop: &Stop,
    ) -> SolveReport {
        self.update_block_structure(model, kin, problem);
        let n = v.len();
        for buffer in
            [&mut self.av, &mut self.a_direction, &mut self.gradient, &mut self.direction, &mut self.rhs]
        {
            buffer.resize(n, 0.0);
        }
        self.hessians.resize(problem.points.len(), ConeHessian::Open);
        self.axis_curvature.resize(problem.axis_terms.len(), 0.0);
        for buffer in [&mut self.row_curvature, &mut self.row_velocity, &mut self.row_direction] {
            buffer.resize(problem.rows, 0.0);
        }
        self.momentum = 0.0;
        for (w, p) in self.inverse_diagonal.iter().zip(&problem.momentum) {
            self.momentum += w * p * p;
        }
        multiply(model, problem, v, &mut self.av);
        self.project(model, kin, problem, v, false);
        self.gradient_at(model, kin, problem, v);
        let mut report = SolveReport { residual: self.residual(problem), ..SolveReport::default() };
        // All laws at one velocity, and products with A.
        let evaluation = POINT_WORK * (problem.points.len() + problem.objects.len() + problem.rows) as u64
            + hand_work(self.link_force.len(), problem.hand_dofs);
        // For the line search: laws only.
        let scalars = problem.axis_terms.len() + problem.rows;
        let look = POINT_WORK * problem.points.len() as u64 + 10 * scalars as u64;
        report.work = evaluation;
        // An island that is nearly balanced is at rest: with a coarse tolerance it would visibly creep.
        let Stop { tolerance, max_iterations, max_work } = *stop;
        let tolerance = if report.residual < AT_REST { REST_TOLERANCE * tolerance } else { tolerance };
        while report.residual >= tolerance && report.iterations < max_iterations && report.work <= max_work {
            report.iterations += 1;
            self.assemble(model, kin, problem);
            report.work += 2 * evaluation + self.cholesky.work();
            if !self.cholesky.factor() {
                report.residual = f64::NAN;
                report.unsolvable = true;
                return report;
            }
            self.rhs.clear();
            self.rhs.extend(self.gradient.iter().map(|g| -g));
            if problem.hand_dofs > 0 {
                self.rhs.resize(n + problem.rows, 0.0);
            }
            self.cholesky.solve(&mut self.rhs, &mut self.scratch);
            let mut direction = std::mem::take(&mut self.direction);
            direction.copy_from_slice(&self.rhs[..n]);
            if problem.bolted {
                direction[..6].fill(0.0);
            }
            self.project(model, kin, problem, &direction, true);
            multiply(model, problem, &direction, &mut self.a_direction);
            let slope = dot(&direction, &self.gradient);
            if is_rounding(problem, slope) {
                self.direction = direction;
                report.residual = 0.0;
                break;
            }
            // The full step is nearly always right, and the next gradient is needed anyway.
            self.advance(problem, v, &direction, 1.0);
            self.gradient_at(model, kin, problem, v);
            report.residual = self.residual(problem);
            let fine = report.iterations > MANY_ITERATIONS;
            let content = slope.abs() * if fine { FINE_LINE_TOLERANCE } else { LINE_TOLERANCE };
            let enough = dot(&direction, &self.gradient).abs() <= content;
            if report.residual >= tolerance && !enough {
                let before = report.evaluations;
                let more = self.line_search(problem, v, &direction, content, &mut report);
                report.work += evaluation + look * (report.evaluations - before) as u64;
                self.advance(problem, v, &direction, more);
                self.gradient_at(model, kin, problem, v);
                report.residual = self.residual(problem);
            }
            self.direction = direction;
        }
        report.converged = report.residual < tolerance;
        report
    }

    /// Moves along the search direction: `v += step · direction`, and everything linear in v with it.
    fn advance(&mut self, problem: &mut Problem, v: &mut [f64], direction: &[f64], step: f64) {
        for (v, by) in v.iter_mut().zip(direction) {
            *v += step * by;
        }
        for (av, by) in self.av.iter_mut().zip(&self.a_direction) {
            *av += step * by;
        }
        for pair in &mut problem.pairs {
            pair.relative += pair.direction * step;
        }
        for point in &mut problem.points {
            for k in 0..4 {
                point.velocity[k] += step * point.direction[k];
            }
        }
        for k in 0..problem.rows {
            self.row_velocity[k] += step * self.row_direction[k];
        }
    }

    /// Impulse at the solution that holds a base with prescribed velocities.
    pub fn mount_impulse(&self) -> [f64; 6] {
        self.mount
    }

    /// Rate of a row at the solution.
    pub fn row_velocity(&self, row: usize) -> f64 {
        self.row_velocity[row]
    }

    /// Impulse of a tendon at the solution.
    pub fn row_impulse(&self, problem: &Problem, row: usize) -> f64 {
        problem.row_terms[row].law.impulse(self.row_velocity[row]).0
    }

    /// Velocities of bodies at `x`, then velocities of pairs, points and rows; on request, of the search
    /// direction.
    pub(super) fn project(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &mut Problem,
        x: &[f64],
        direction: bool,
    ) {
        if let (Some(hand), true) = (model.hand(), problem.hand_dofs > 0) {
            kin.velocities(hand, x, &mut self.link_velocity);
            for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
                let u = term.apply(x);
                if direction {
                    self.row_direction[k] = u;
                } else {
                    self.row_velocity[k] = u;
                }
            }
        }
        let Problem { hand_dofs, pairs, points, .. } = problem;
        let (objects, _) = x[*hand_dofs..].as_chunks::<6>();
        let object = |slot: usize| {
            let v = objects[slot];
            SpatialVelocity { linear: Vec3::new(v[0], v[1], v[2]), angular: Vec3::new(v[3], v[4], v[5]) }
        };
        for pair in pairs {
            let velocity = |body: PairBody| match body {
                PairBody::Fixed => SpatialVelocity::ZERO,
                PairBody::Link(i, lever) => self.link_velocity[i].moved(lever),
                PairBody::Centre(slot) => object(slot),
                PairBody::Object(slot, lever) => object(slot).moved(lever),
            };
            let [a, b] = pair.bodies;
            let relative = match a {
                PairBody::Fixed => velocity(b),
                _ => velocity(b) - velocity(a),
            };
            if direction {
                pair.direction = relative;
            } else {
                pair.relative = relative;
            }
            for point in &mut points[pair.first..pair.end] {
                let u = point.project(relative, pair.patch);
                if direction {
                    point.direction = u;
                } else {
                    point.velocity = u;
                }
            }
        }
    }

    /// Gradient `A v − A v* − Σ Jᵀ γ(J v)`, with the impulses and curvatures.
    fn gradient_at(&mut self, model: &Model, kin: &Kinematics, problem: &mut Problem, v: &[f64]) {
        let h = problem.hand_dofs;
        for ((gradient, av), momentum) in self.gradient.iter_mut().zip(&self.av).zip(&problem.momentum) {
            *gradient = av - momentum;
        }
        let links = if h > 0 { model.hand().map_or(0, |hand| hand.links.len()) } else { 0 };
        self.link_force.clear();
        self.link_force.resize(links, Force::ZERO);
        let (objects, _) = self.gradient[h..].as_chunks_mut::<6>();
        for pair in &problem.pairs {
            let (mut wrench, mut acts) = (Force::ZERO, false);
            let points = &mut problem.points[pair.first..pair.end];
            for (point, known) in points.iter_mut().zip(&mut self.hessians[pair.first..pair.end]) {
                let (gamma, hessian) = point.law.impulse(point.velocity);
                point.impulse = gamma;
                *known = hessian;
                if !matches!(hessian, ConeHessian::Open) {
                    if pair.patch {
                        let [normal, friction] = point.parts(gamma);
                        let moment = point.r.cross(normal) + point.friction_r.cross(friction);
                        let moment = moment + point.torque(gamma);
                        wrench += Force { moment, force: normal + friction };
                    } else {
                        let f =
                            point.axes[0] * gamma[0] + point.axes[1] * gamma[1] + point.axes[2] * gamma[2];
                        wrench += Force { moment: point.r.cross(f), force: f };
                    }
                    acts = true;
                }
            }
            if pair.rolling.limit > 0.0 {
                wrench.moment += pair.rolling.impulse(pair.rolling.rolling(pair.relative.angular)).0;
                acts = true;
            }
            if !acts {
                continue;
            }
            for (body, sign) in pair.bodies.into_iter().zip([-1.0, 1.0]) {
                let (slot, f) = match body {
                    PairBody::Fixed => continue,
                    PairBody::Link(i, lever) => {
                        let f = wrench.moved(-lever);
                        self.link_force[i] += Force { moment: f.moment * sign, force: f.force * sign };
                        continue;
                    }
                    PairBody::Centre(slot) => (slot, wrench),
                    PairBody::Object(slot, lever) => (slot, wrench.moved(-lever)),
                };
                for (gradient, x) in objects[slot].iter_mut().zip(f.components()) {
                    *gradient -= sign * x;
                }
            }
        }
        let (Some(hand), true) = (model.hand(), h > 0) else { return };
        for i in (1..links).rev() {
            if let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
                let f = self.link_force[i];
                self.gradient[6 + joint.coordinate] -= kin.screw[i].dot(f);
                self.link_force[parent] += f;
            }
        }
        let f = self.link_force[0];
        for (k, x) in f.components().into_iter().enumerate() {
            self.gradient[k] -= x;
        }
        for (k, term) in problem.axis_terms.iter().enumerate() {
            let (impulse, curvature) = term.law.impulse(term.sign * v[term.dof]);
            self.gradient[term.dof] -= term.sign * impulse;
            self.axis_curvature[k] = curvature;
        }
        for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
            let (impulse, curvature) = term.law.impulse(self.row_velocity[k]);
            self.row_curvature[k] = curvature;
            for &(dof, r) in &term.row {
                self.gradient[dof] -= r * impulse;
            }
        }
        if problem.bolted {
            self.mount.copy_from_slice(&self.gradient[..6]);
            self.gradient[..6].fill(0.0);
        }
    }

    /// Norm of the gradient relative to the momenta, in the metric of diag(A)⁻¹.
    fn residual(&self, problem: &Problem) -> f64 {
        let (mut gradient, mut impulse) = (0.0, 0.0);
        let known =
            self.inverse_diagonal.iter().zip(&self.gradient).zip(problem.momentum.iter().zip(&self.av));
        for ((w, g), (p, av)) in known {
            let j = av - p - g;
            gradient += w * g * g;
            impulse += w * j * j;
        }
        // Below 1e-14 √J all velocities are rounding noise.
        if gradient < 1e-28 { 0.0 } else { (gradient / f64::max(self.momentum, impulse)).sqrt() }
    }

    /// Root of ℓ' along the direction by safeguarded Newton, relative to the present point, which is the full
    /// step, until |ℓ'| is at most `content`.
    fn line_search(
        &self,
        problem: &Problem,
        v: &[f64],
        direction: &[f64],
        content: f64,
        report: &mut SolveReport,
    ) -> f64 {
        let quadratic = dot(direction, &self.a_direction);
        let linear = dot(direction, &self.av) - dot(direction, &problem.momentum);
        let derivatives = |alpha: f64| {
            let (mut first, mut second) = (linear + alpha * quadratic, quadratic);
            for pair in &problem.pairs {
                for point in &problem.points[pair.first..pair.end] {
                    let w = point.direction;
                    let u = [
                        point.velocity[0] + alpha * w[0],
                        point.velocity[1] + alpha * w[1],
                        point.velocity[2] + alpha * w[2],
                        point.velocity[3] + alpha * w[3],
                    ];
                    let (gamma, hessian) = point.law.impulse(u);
                    first -= w[0] * gamma[0] + w[1] * gamma[1] + w[2] * gamma[2] + w[3] * gamma[3];
                    second += point.law.curvature(&hessian, w);
                }
                if pair.rolling.limit > 0.0 {
                    let w = pair.rolling.rolling(pair.direction.angular);
                    let omega = pair.rolling.rolling(pair.relative.angular) + w * alpha;
                    let (torque, isotropic, radial) = pair.rolling.impulse(omega);
                    first -= w.dot(torque);
                    second += isotropic * w.dot(w) - radial * omega.dot(w).powi(2);
                }
            }
            for term in &problem.axis_terms {
                let du = term.sign * direction[term.dof];
                let (impulse, curvature) = term.law.impulse(term.sign * v[term.dof] + alpha * du);
                first -= du * impulse;
                second += curvature * du * du;
            }
            for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
                let du = self.row_direction[k];
                let (impulse, curvature) = term.law.impulse(self.row_velocity[k] + alpha * du);
                first -= du * impulse;
                second += curvature * du * du;
            }
            (first, second)
        };
        // The laws are already evaluated at the present point.
        let here = || {
            let mut second = quadratic;
            for pair in &problem.pairs {
                let points = &problem.points[pair.first..pair.end];
                for (point, hessian) in points.iter().zip(&self.hessians[pair.first..pair.end]) {
                    second += point.law.curvature(hessian, point.direction);
                }
                if pair.rolling.limit > 0.0 {
                    let [w, omega] =
                        [pair.direction, pair.relative].map(|motion| pair.rolling.rolling(motion.angular));
                    let (_, isotropic, radial) = pair.rolling.impulse(omega);
                    second += isotropic * w.dot(w) - radial * omega.dot(w).powi(2);
                }
            }
            for (term, curvature) in problem.axis_terms.iter().zip(&self.axis_curvature) {
                second += curvature * direction[term.dof] * direction[term.dof];
            }
            for (du, curvature) in self.row_direction.iter().zip(&self.row_curvature).take(problem.rows) {
                second += curvature * du * du;
            }
            (dot(direction, &self.gradient), second)
        };
        let (mut alpha, mut low, mut high) = (0.0, -1.0, f64::INFINITY);
        for k in 0..40 {
            report.evaluations += 1;
            let (first, second) = if k == 0 { here() } else { derivatives(alpha) };
            if first.abs() <= content {
                break;
            }
            if first < 0.0 {
                low = alpha;
            } else {
                high = alpha;
            }
            let mut next = alpha - first / second;
            if !(next > low && next < high) {
                next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * alpha + 1.0 };
            }
            if (next - alpha).abs() < 1e-12 {
                break;
            }
            alpha = next;
        }
        alpha
    }
}

/// Whether the possible gain of an iteration, `gᵀ H⁻¹ g`, is rounding of impulses that balance each other, as
/// between parts of a hand that press on each other: `(ε γ)²/k` summed over the contacts. No iteration brings
/// the gradient below that.
fn is_rounding(problem: &Problem, slope: f64) -> bool {
    // Anything that moves is far above it.
    if slope.abs() > 1e-20 {
        return false;
    }
    let of = |point: &Point| {
        let [t1, t2, n, spin] = point.impulse;
        (t1 * t1 + t2 * t2 + spin * spin) / point.law.tangential + n * n / point.law.normal
    };
    slope.abs() <= ROUNDING * ROUNDING * problem.points.iter().map(of).sum::<f64>()
}

/// Rounding of a sum of a few impulses, relative to them.
const ROUNDING: f64 = 4e-15;

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::friction_cone::{ConeLaw, RollingLaw};
    use super::super::problem::{ObjectProblem, PairProblem};
    use super::*;
    use crate::config::Config;
    use crate::model::Owner;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_models::{Mat3, Pose};
    use std::sync::Arc;

    const MASS: f64 = 2.0;
    const STIFF: f64 = 1e3;

    /// A ball supported by one frictional point at its centre, after a step with velocity v*.
    fn on_a_point(friction: f64, free: Vec3) -> (Model, Problem) {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.1 })];
        let ball = Object::new("ball", parts, MASS, friction, 0.0).expect("sound");
        model.add_object(Arc::new(ball)).expect("it fits");
        let law = ConeLaw::new(friction, STIFF, STIFF, [0.0; 3]);
        let rolling = RollingLaw::default();
        let problem = Problem {
            objects: vec![ObjectProblem {
                object: 0,
                center: Vec3::ZERO,
                mass: MASS,
                inertia: Mat3::IDENTITY,
                turn: None,
            }],
            momentum: vec![MASS * free.x, MASS * free.y, MASS * free.z, 0.0, 0.0, 0.0],
            pairs: vec![PairProblem::new(Owner::Static, Owner::Object(0), Vec3::ZERO, rolling, 0, 1)],
            points: vec![Point::new(Vec3::ZERO, Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::Z], law)],
            fresh: true,
            ..Problem::default()
        };
        (model, problem)
    }

    fn solved(friction: f64, free: Vec3) -> (Vec<f64>, [f64; 4]) {
        let (model, mut problem) = on_a_point(friction, free);
        let mut v = vec![free.x, free.y, free.z, 0.0, 0.0, 0.0];
        let stop = Stop { tolerance: 1e-10, max_iterations: 50, max_work: u64::MAX };
        let report = Newton::default().solve(&model, &Kinematics::default(), &mut problem, &mut v, &stop);
        assert!(report.converged && !report.unsolvable, "{report:?}");
        (v, problem.points[0].impulse)
    }

    #[test]
    fn the_minimum_balances_momentum_and_impulse() {
        for free in [Vec3::new(0.0, 0.0, -1.0), Vec3::new(3.0, -1.0, -1.0), Vec3::new(0.1, 0.0, -2.0)] {
            let (v, gamma) = solved(0.5, free);
            for k in 0..3 {
                assert!((MASS * (v[k] - free[k]) - gamma[k]).abs() < 1e-8, "{free}: {v:?} {gamma:?}");
            }
        }
    }

    #[test]
    fn a_point_sticks_within_the_cone_slides_on_it_and_lets_go_beyond() {
        let size = |gamma: [f64; 4]| (gamma[0] * gamma[0] + gamma[1] * gamma[1]).sqrt();
        let (v, stuck) = solved(0.5, Vec3::new(0.1, 0.0, -2.0));
        assert!(size(stuck) < 0.5 * stuck[2] && v[0].abs() < 1e-3);
        let (v, slid) = solved(0.5, Vec3::new(3.0, 0.0, -1.0));
        assert!((size(slid) - 0.5 * slid[2]).abs() < 1e-9 && v[0] > 1.0);
        assert_eq!(solved(0.5, Vec3::new(0.0, 0.0, 1.0)).1, [0.0; 4]);
    }

    #[test]
    fn a_solve_ends_without_an_answer_when_it_may_not_compute() {
        let (model, mut problem) = on_a_point(0.5, Vec3::new(3.0, 0.0, -1.0));
        let mut v = vec![3.0, 0.0, -1.0, 0.0, 0.0, 0.0];
        let stop = Stop { tolerance: 1e-10, max_iterations: 0, max_work: u64::MAX };
        let report = Newton::default().solve(&model, &Kinematics::default(), &mut problem, &mut v, &stop);
        assert!(!report.converged);
    }
}
