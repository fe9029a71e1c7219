//! Solves an island and takes over the result: velocities, positions, contact memory, forces, sleep.

use super::free::{advanced, turned};
use super::impacts::Met;
use super::mean::{Correction, correction};
use super::pose::{glide, rest_target};
use crate::bounds::{Fault, STEP_WORK};
use crate::contact::anchor::{Anchor, stretch_after, stretch_sliding};
use crate::model::Owner;
use crate::solver::island::Island;
use crate::solver::newton::{Newton, Stop};
use crate::solver::problem::Problem;
use crate::world::{ContactForce, World};
use palmares_models::Vec3;

/// How often a step with a lone object, in the hand or out of it, is solved again because slip changed: each pass leaves
/// a tenth of the error or so. With more objects something begins to slide at nearly every step: a hand among balls took
/// 3 % more instructions, and in heaps one in a thousand gained energy. There the lagged slip has to do.
const GLIDE_PASSES: usize = 2;

/// Contacts of this stiffness, N/m, hang by so little that these passes are enough. Harder ones carry nothing at a gap that
/// is smaller in proportion: a tenth for every pass more.
const HOVER_STIFFNESS: f64 = 2e5;

impl World {
    /// Takes one step of an island; `slot` is where its solver keeps its orderings.
    pub(super) fn solve_island(&mut self, island: &Island, slot: usize) {
        if self.work.solvers.len() == slot {
            self.work.solvers.push(Default::default());
        }
        let alone = island.hand && island.objects.is_empty();
        let undamped = self.model.undamped_hand();
        if alone && undamped && island.pairs.is_empty() && self.explicit_step() {
            return;
        }
        let mut solvers = std::mem::take(&mut self.work.solvers);
        let (problem, newton) = &mut solvers[slot];
        let mut v = std::mem::take(&mut self.work.velocity);
        let done = alone && !undamped && self.smooth_step(island, problem, newton, &mut v);
        if !island.hand {
            self.implicit_step(island, problem, newton, &mut v);
        } else if !done {
            let mut earlier = std::mem::take(&mut self.state.earlier);
            self.write_hand(&mut earlier);
            self.implicit_step(island, problem, newton, &mut v);
            let touches = problem.points.iter().any(|point| point.impulse[2] > 0.0);
            let smooth = alone && !touches && self.work.limits.is_empty() && self.work.servo_on;
            earlier.smooth = smooth && !undamped;
            self.state.earlier = earlier;
        }
        self.work.velocity = v;
        self.work.solvers = solvers;
    }

    /// Implicit Euler: forces and velocities of the end of the step. Stable for any stiffness and contact.
    fn implicit_step(
        &mut self,
        island: &Island,
        problem: &mut Problem,
        newton: &mut Newton,
        v: &mut Vec<f64>,
    ) {
        let h = self.model.config().step_s;
        let cascade = self.find_rebounds(island);
        self.pose_problem(island, problem, v, h);
        self.minimise(problem, newton, v, self.model.config().tolerance);
        if cascade && !self.keep_cascade(island, problem) {
            self.pose_problem(island, problem, v, h);
            self.minimise(problem, newton, v, self.model.config().tolerance);
        }
        let harder = (self.model.config().contact_stiffness / HOVER_STIFFNESS).max(1.0);
        let more = if harder > 1.0 { libm::log10(harder).ceil() as usize } else { 0 };
        let passes = GLIDE_PASSES + more;
        for pass in 0..if island.objects.len() <= 1 { passes } else { 0 } {
            // Slip that changes evenly is left to the lag, however hard the contact.
            if !self.correct_glide(island, problem, if pass == 0 { 1.0 } else { harder }) {
                break;
            }
            self.minimise(problem, newton, v, self.model.config().tolerance);
        }
        self.remember(island, problem);
        self.report_hand_forces(island, problem, newton, v, h);
        let floats = island.hand && !self.work.servo_on;
        let due = floats.then(|| (self.momentum_due(v), self.work.kin.origin));
        self.integrate(island, problem, v);
        if let Some((due, from)) = due {
            self.keep_momentum(due, from);
        }
    }

    pub(super) fn minimise(
        &mut self,
        problem: &mut Problem,
        newton: &mut Newton,
        v: &mut [f64],
        tolerance: f64,
    ) {
        let max_iterations = self.model.config().max_iterations;
        let stop = Stop { tolerance, max_iterations, max_work: STEP_WORK.saturating_sub(self.outcome.work) };
        let report = newton.solve(&self.model, &self.work.kin, problem, v, &stop);
        self.outcome.work += report.work;
        if report.unsolvable {
            self.fault = Some(Fault::Unsolvable);
        }
        self.outcome.iterations = self.outcome.iterations.max(report.iterations);
        self.outcome.evaluations += report.evaluations;
        self.outcome.converged &= report.converged;
    }

    /// Tensions, servo forces and limit torques at the solution.
    pub(super) fn report_hand_forces(
        &mut self,
        island: &Island,
        problem: &Problem,
        newton: &Newton,
        v: &[f64],
        h: f64,
    ) {
        if island.hand {
            for k in 0..problem.rows {
                self.state.tension[k] = newton.row_impulse(problem, k) / h;
            }
            self.work.servo_force =
                if problem.held { newton.mount_impulse().map(|impulse| impulse / h) } else { [0.0; 6] };
            for term in &problem.axis_terms {
                let force = term.sign * term.law.impulse(term.sign * v[term.dof]).0 / h;
                if term.dof < 6 {
                    self.work.servo_force[term.dof] = force;
                } else if force != 0.0 {
                    self.work.limits.push((*term, force));
                }
            }
        }
    }

    /// Where slip sets in or ends so suddenly that the lagged slip says nothing, takes that of the solution instead:
    /// convexity would lift such a contact by μ h v. True if there is any; `finer` is by how much less than usual counts.
    fn correct_glide(&self, island: &Island, problem: &mut Problem, finer: f64) -> bool {
        let config = self.model.config();
        let least = if island.hand { config.hand_hover_m } else { config.hover_m } / finer;
        let mut any = false;
        for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
            let found = &self.work.contacts.pairs[index];
            let points = &self.work.contacts.points[found.points.clone()];
            for (point, seen) in problem.points[solved.first..solved.end].iter_mut().zip(points) {
                let (rest, tau_n) = rest_target(config, found, seen);
                // What carries nothing is right to, unless it goes on into the other surface: it has been thought to slip
                // faster than it does.
                let open = point.impulse[2] <= 0.0;
                if open && point.velocity[2] >= rest || seen.rebound.is_some() {
                    continue;
                }
                let slip = point.law.slip_speed(point.velocity, point.impulse);
                let target = rest - glide(config, found, slip);
                // The law lifts a surface over the step and the dissipation time. What a lone object on the ground
                // loses by that is made good by the next step; solving it again would move where slip ends.
                let over_s = config.step_s + if island.hand { tau_n } else { 0.0 };
                if (target - point.law.target[2]).abs() * over_s > least {
                    point.law.target[2] = target;
                    any = true;
                }
            }
        }
        any
    }

    /// Writes anchors back to the manifolds and the contact forces out.
    pub(super) fn remember(&mut self, island: &Island, problem: &Problem) {
        let config = self.model.config();
        let (h, tau) = (config.step_s, config.contact_dissipation_s);
        // A point that was not worth solving for has been blanked by the search already.
        for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
            let found = &self.work.contacts.pairs[index];
            let pair = &mut self.state.pairs[found.pair];
            let into_a = self.work.poses[pair.key.0 as usize].rotation.inverse();
            let (mut mean, mut loaded) = (Anchor::default(), 0.0);
            let points = &self.work.contacts.points[found.points.clone()];
            for (point, seen) in problem.points[solved.first..solved.end].iter().zip(points) {
                let [t1, t2, n] = point.axes;
                let [g1, g2, gn] = point.impulse;
                let data = &mut pair.manifold.points[seen.point as usize].data;
                if gn <= 0.0 {
                    *data = Anchor::IDLE;
                    continue;
                }
                // What a rebound exchanges in an instant says nothing about the next step.
                if let Some(rebound) = seen.rebound {
                    *data = Anchor::IDLE;
                    // One that was only not to be braked met nothing.
                    for owner in [found.a, found.b].into_iter().filter(|_| rebound.time_s.is_finite()) {
                        if let Owner::Object(k) = owner {
                            let met = &mut self.work.met[k];
                            *met = Some(met.map_or(Met::at(rebound.time_s), |met| met.or_at(rebound.time_s)));
                        }
                    }
                    continue;
                }
                let friction = t1 * g1 + t2 * g2;
                // The law saw the stretch's projection on the tangent plane.
                let before = t1 * seen.anchor.stretch.dot(t1) + t2 * seen.anchor.stretch.dot(t2);
                let mut stretch = stretch_after(before, friction, config.anchor_stiffness, tau, h);
                let slip = point.law.slip_speed(point.velocity, point.impulse);
                if slip > 0.0 {
                    stretch = stretch_sliding(stretch, friction, config.anchor_stiffness, h);
                }
                let normal_force = gn / h;
                *data = Anchor { known: true, loaded: true, stretch: into_a * stretch, slip, normal_force };
                loaded += 1.0;
                mean.stretch += data.stretch;
                mean.slip += slip;
                self.work.forces.push(ContactForce {
                    a: found.a,
                    b: found.b,
                    colliders: pair.key,
                    position: found.origin + point.r,
                    normal: n,
                    force: (friction + n * gn) / h,
                    distance: seen.distance,
                });
            }
            if loaded > 0.0 {
                mean.stretch /= loaded;
                mean.slip /= loaded;
            }
            pair.mean = mean;
        }
    }

    /// Moves the hand with velocity `v` for a time.
    pub(super) fn move_hand(&mut self, v: &[f64], time_s: f64) {
        let (n, state) = (self.model.hand_dofs(), &mut self.state);
        state.v[..n].copy_from_slice(&v[..n]);
        state.base = advanced(state.base, &mut state.q, &v[..n], time_s);
        if self.work.held {
            state.base = state.reference.pose;
        }
    }

    /// Positions move with the velocities of the end of the step, or with the mean where nothing is stiff.
    fn integrate(&mut self, island: &Island, problem: &Problem, v: &[f64]) {
        let h = self.model.config().step_s;
        let mut at = 0;
        if island.hand {
            at = self.model.hand_dofs();
            self.move_hand(v, h);
        }
        let state = &mut self.state;
        let gravity = self.model.config().gravity;
        let alone = !island.hand && island.objects.len() == 1;
        for (slot, (&k, solved)) in island.objects.iter().zip(&problem.objects).enumerate() {
            let to = self.model.object_dofs(k);
            let own = &v[at..at + 6];
            let after = Vec3::new(own[0], own[1], own[2]);
            let angular = Vec3::new(own[3], own[4], own[5]);
            let before = Vec3::new(state.v[to], state.v[to + 1], state.v[to + 2]);
            let carried = match solved.turn {
                None => Vec3::new(state.v[to + 3], state.v[to + 4], state.v[to + 5]),
                Some((_, omega)) => omega,
            };
            let pose = &mut state.objects[k];
            let mut more = Correction::default();
            match self.work.met[k].take() {
                None if !alone => pose.translation += after * h,
                None => {
                    let short = ((before - after) * (0.5 * h), (carried - angular) * (0.5 * h));
                    more = correction(problem, slot, angular * h, short.0, short.1);
                    // Nothing may go farther than the faster of its velocities takes it: gaps are trusted for that.
                    let farthest = before.length_squared().max(after.length_squared()) * h * h;
                    if (after * h + more.linear).length_squared() > farthest {
                        more = Correction::default();
                    }
                    pose.translation += after * h + more.linear;
                }
                // A rebound at time t: ballistic before and after it.
                Some(Met { time_s: t, detour }) => {
                    let rest = h - t;
                    pose.translation +=
                        before * t + after * rest + gravity * (0.5 * (t * t - rest * rest)) + detour;
                }
            }
            state.v[to..to + 6].copy_from_slice(own);
            // Torque turns the body on from where it comes to without: its angular momentum is kept to rounding.
            pose.rotation = match solved.turn {
                None => turned(pose.rotation, angular * h + more.angular),
                Some((rotation, omega)) => turned(rotation, (angular - omega) * h + more.angular),
            };
            at += 6;
        }
    }

    /// Counts the steps an island has been still, and stops it when they are enough.
    pub(super) fn fall_asleep(&mut self, island: &Island) {
        let config = self.model.config();
        if !config.sleeping {
            return;
        }
        let enough = (config.sleep_after_s / config.step_s).ceil() as u32;
        let mut all = !island.hand && !island.pairs.is_empty();
        for &k in &island.objects {
            let (linear, angular) = self.state.object_velocity(&self.model, k);
            let still = linear.length_squared() < config.sleep_linear.powi(2)
                && angular.length_squared() < config.sleep_angular.powi(2);
            let sleep = &mut self.state.sleep[k];
            sleep.still_steps = if still { (sleep.still_steps + 1).min(enough) } else { 0 };
            all &= sleep.still_steps == enough;
        }
        if all {
            for &k in &island.objects {
                let at = self.model.object_dofs(k);
                self.state.v[at..at + 6].fill(0.0);
                self.state.sleep[k].asleep = true;
                self.state.sleep[k].still_steps = 0;
            }
        }
    }
}
