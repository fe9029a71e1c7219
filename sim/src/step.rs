//! One step: forces and contacts at the start, one convex solve for the velocities at the end, integration.

use crate::actuation::{base, motor, tendon};
use crate::contact::anchor::{Anchor, stretch_after};
use crate::contact::broad::tight_bounds;
use crate::dynamics::jacobian::add_point_force;
use crate::dynamics::spatial::Motion;
use crate::model::Owner;
use crate::solver::cone::{ConeLaw, RollingLaw};
use crate::solver::island::Island;
use crate::solver::problem::{ObjectProblem, PairProblem, Point, Problem};
use crate::solver::terms::{AxisTerm, ScalarLaw};
use crate::world::{Command, ContactForce, FreeTurn, Outcome, Phase, Probe, World};
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use parry3d_f64::bounding_volume::Aabb;
use std::sync::Arc;

impl World {
    /// Advances the world by one step.
    pub fn step(&mut self, command: &Command) -> &Outcome {
        self.step_probed(command, &mut ())
    }

    /// Advances the world by one step and tells `probe` when a phase is over.
    pub fn step_probed(&mut self, command: &Command, probe: &mut impl Probe) -> &Outcome {
        self.actuate(command);
        self.dynamics(command);
        probe.ended(Phase::Dynamics);
        self.collide();
        probe.ended(Phase::Collision);
        self.solve();
        self.state.step += 1;
        probe.ended(Phase::Solver);
        &self.outcome
    }

    fn actuate(&mut self, command: &Command) {
        let Some(hand) = self.model.hand() else { return };
        let h = self.model.config().step_s;
        base::advance(self.model.config(), &mut self.state.reference, &command.base);
        for (i, motor) in hand.motors.iter().enumerate() {
            let state = &mut self.state.motors[i];
            let sigma = command.sigma.get(i).copied().unwrap_or(state.command);
            motor::advance(motor, state, sigma, h);
        }
    }

    /// Mass matrix and bias of the hand; torque-free motion of the objects.
    fn dynamics(&mut self, command: &Command) {
        let (model, state, work) = (&self.model, &self.state, &mut self.work);
        let config = model.config();
        if let Some(hand) = model.hand() {
            let n = model.hand_dofs();
            work.mass.resize(n * n, 0.0);
            work.bias.resize(n, 0.0);
            work.kin.update(hand, state.base, &state.q);
            work.inertias.update(hand, &work.kin);
            work.inertias.mass_matrix(hand, &work.kin, &mut work.mass);
            let gravity = config.gravity;
            work.recursion.bias(hand, &work.kin, &work.inertias, &state.v[..n], gravity, &mut work.bias);
            for push in &command.pushes {
                let point = work.kin.pose[push.link].transform_point(push.point);
                add_point_force(hand, &work.kin, push.link, point, push.force, -1.0, &mut work.bias);
            }
        }
        work.free_turn.clear();
        for (k, object) in model.objects().iter().enumerate() {
            let rotation = state.objects[k].rotation;
            let (_, omega) = state.object_velocity(model, k);
            let inverse = model.object_inertia_inverse(k);
            work.free_turn.push(torque_free(rotation, omega, object.inertia, inverse, config.step_s));
        }
    }

    /// Bounds, near pairs, contact points; sleepers that are touched wake, and with them what they touch.
    fn collide(&mut self) {
        let (model, state, work) = (&self.model, &mut self.state, &mut self.work);
        let margin = 0.5 * model.config().margin();
        let fresh = work.bounds.len() != model.colliders().len();
        if fresh {
            work.poses.resize(model.colliders().len(), Pose::IDENTITY);
            work.bounds.resize(model.colliders().len(), Aabb::new_invalid());
        }
        for (i, collider) in model.colliders().iter().enumerate() {
            let pose = match collider.owner {
                // Furniture is where it was.
                Owner::Static if !fresh => continue,
                Owner::Static => collider.body_from_shape,
                Owner::Link(i) => work.kin.pose[i] * collider.body_from_shape,
                Owner::Object(k) => state.objects[k] * collider.body_from_shape,
            };
            work.bounds[i] = tight_bounds(&collider.local_bounds, &pose, margin);
            work.poses[i] = pose;
        }
        work.broad.update(model, &work.bounds, &mut state.pairs);
        let (v, centers, origin) = (&state.v, &state.objects, work.kin.origin);
        let velocity = |owner: Owner, at: Vec3| match owner {
            Owner::Static => Motion::ZERO,
            Owner::Link(i) => work.recursion.velocity[i].moved(at - origin),
            Owner::Object(k) => {
                let v = &v[model.object_dofs(k)..];
                let motion =
                    Motion { linear: Vec3::new(v[0], v[1], v[2]), angular: Vec3::new(v[3], v[4], v[5]) };
                motion.moved(at - centers[k].translation)
            }
        };
        work.speeds.clear();
        work.speeds.extend(model.colliders().iter().zip(&work.poses).map(|(collider, pose)| {
            match collider.owner {
                Owner::Static => 0.0,
                owner => {
                    let motion = velocity(owner, pose.translation);
                    motion.linear.length() + motion.angular.length() * collider.reach
                }
            }
        }));
        loop {
            let sleep = &state.sleep;
            work.contacts.find(
                model,
                &work.poses,
                &work.bounds,
                &work.speeds,
                work.kin.origin,
                &state.objects,
                |owner| match owner {
                    Owner::Static => false,
                    Owner::Link(_) => true,
                    Owner::Object(k) => !sleep[k].asleep,
                },
                velocity,
                &mut state.pairs,
            );
            let mut woken = false;
            for pair in &work.contacts.pairs {
                for owner in [pair.a, pair.b] {
                    if let Owner::Object(k) = owner {
                        woken |= state.sleep[k].asleep;
                        state.sleep[k].asleep = false;
                    }
                }
            }
            if !woken {
                break;
            }
        }
    }

    fn solve(&mut self) {
        let mut islands = std::mem::take(&mut self.work.islands);
        islands.update(&self.model, &self.work.contacts);
        self.work.forces.clear();
        self.work.limits.clear();
        self.outcome =
            Outcome { converged: true, points: self.work.contacts.points.len(), ..Outcome::default() };
        for point in &self.work.contacts.points {
            self.outcome.penetration_m = self.outcome.penetration_m.max(-point.distance);
        }
        let mut used = 0;
        for island in islands.list() {
            if let (false, [object]) = (island.hand, island.objects.as_slice())
                && self.state.sleep[*object].asleep
            {
                continue;
            }
            if !island.hand && island.pairs.is_empty() {
                self.fly(island.objects[0]);
            } else {
                self.solve_island(island, used);
                used += 1;
            }
            self.fall_asleep(island);
        }
        self.outcome.islands = used;
        self.outcome.asleep = self.state.sleep.iter().filter(|sleep| sleep.asleep).count();
        self.work.islands = islands;
    }

    /// Exact ballistic motion of an object that touches nothing.
    fn fly(&mut self, object: usize) {
        let config = self.model.config();
        let (h, at) = (config.step_s, self.model.object_dofs(object));
        let v = &mut self.state.v[at..at + 6];
        let before = Vec3::new(v[0], v[1], v[2]);
        let after = before + config.gravity * h;
        let turn = &self.work.free_turn[object];
        v[..3].copy_from_slice(&after.to_array());
        v[3..].copy_from_slice(&turn.angular.to_array());
        let pose = &mut self.state.objects[object];
        pose.translation += (before + after) * (0.5 * h);
        pose.rotation = turn.rotation;
    }

    fn solve_island(&mut self, island: &Island, slot: usize) {
        if self.work.solvers.len() == slot {
            self.work.solvers.push(Default::default());
        }
        let (mut problem, mut newton) = std::mem::take(&mut self.work.solvers[slot]);
        let mut v = std::mem::take(&mut self.work.velocity);
        self.pose_problem(island, &mut problem, &mut v);
        let model = Arc::clone(&self.model);
        let config = model.config();
        let report = newton.solve(
            &model,
            &self.work.kin,
            &mut problem,
            &mut v,
            config.tolerance,
            config.max_iterations,
        );
        self.outcome.iterations = self.outcome.iterations.max(report.iterations);
        self.outcome.evaluations += report.evaluations;
        self.outcome.converged &= report.converged;
        self.remember(island, &problem);
        if island.hand {
            let h = config.step_s;
            for k in 0..problem.rows {
                self.state.tension[k] = newton.row_impulse(&problem, k) / h;
            }
            for (k, term) in problem.axis_terms.iter().enumerate() {
                let force = term.sign * term.law.impulse(term.sign * v[term.dof]).0 / h;
                if k < 6 {
                    self.work.servo_force[k] = force;
                } else if force != 0.0 {
                    self.work.limits.push((*term, force));
                }
            }
        }
        self.integrate(island, &v);
        self.work.velocity = v;
        self.work.solvers[slot] = (problem, newton);
    }

    /// Fills in A, A v*, contacts and terms; `v` becomes the starting point, the present velocities.
    fn pose_problem(&self, island: &Island, problem: &mut Problem, v: &mut Vec<f64>) {
        let (model, state, work) = (&self.model, &self.state, &self.work);
        let config = model.config();
        let h = config.step_s;
        v.clear();
        problem.momentum.clear();
        problem.axis_terms.clear();
        problem.objects.clear();
        problem.hand_dofs = 0;
        problem.rows = 0;
        if let (Some(hand), true) = (model.hand(), island.hand) {
            let n = model.hand_dofs();
            problem.hand_dofs = n;
            problem.hand_matrix.clear();
            problem.hand_matrix.extend_from_slice(&work.mass);
            v.extend_from_slice(&state.v[..n]);
            for i in 0..n {
                let mut p = -h * work.bias[i];
                for j in 0..n {
                    p += work.mass[i * n + j] * v[j];
                }
                problem.momentum.push(p);
            }
            base::servo(config, &state.reference, state.base, &mut problem.axis_terms);
            for (i, coordinate) in hand.coordinates.iter().enumerate() {
                let k = 6 + i;
                let (e, d) = (coordinate.stiffness, coordinate.damping);
                problem.hand_matrix[k * n + k] += h * d + h * h * e;
                problem.momentum[k] -= h * e * (state.q[i] - coordinate.rest);
                let lower = state.q[i] - coordinate.lower;
                let upper = coordinate.upper - state.q[i];
                let inverse_mass = 1.0 / problem.hand_matrix[k * n + k];
                push_limit(&mut problem.axis_terms, config, k, 1.0, lower, v[k], inverse_mass);
                push_limit(&mut problem.axis_terms, config, k, -1.0, upper, -v[k], inverse_mass);
            }
            tendon::terms(hand, &state.q, &state.motors, h, &mut problem.row_terms);
            problem.rows = hand.tendons.len();
        }
        for &k in &island.objects {
            let object = &model.objects()[k];
            let (linear, angular) = state.object_velocity(model, k);
            v.extend(linear.to_array());
            v.extend(angular.to_array());
            let turn = &work.free_turn[k];
            problem.momentum.extend(((linear + config.gravity * h) * object.mass).to_array());
            problem.momentum.extend((turn.inertia * turn.angular).to_array());
            problem.objects.push(ObjectProblem {
                object: k,
                center: state.objects[k].translation,
                mass: object.mass,
                inertia: turn.inertia,
            });
        }
        self.pose_contacts(island, problem);
    }

    fn pose_contacts(&self, island: &Island, problem: &mut Problem) {
        let config = self.model.config();
        let (h, tau) = (config.step_s, config.contact_dissipation_s);
        problem.pairs.clear();
        problem.points.clear();
        for &index in &island.pairs {
            let pair = &self.work.contacts.pairs[index];
            let first = problem.points.len();
            let mut load = 0.0;
            let found = &self.work.contacts.points[pair.points.clone()];
            let w = self.inverse_mass(pair.a, pair.origin, found[0].r)
                + self.inverse_mass(pair.b, pair.origin, found[0].r);
            let near_rigid = config.near_rigid.powi(2) / (4.0 * std::f64::consts::PI.powi(2)) * w;
            let tangential = h * config.anchor_stiffness * (h + tau);
            for point in found {
                let [t1, t2] = point.tangents;
                let axes = [t1, t2, point.normal];
                let tau_n = if point.distance < 0.0 { tau } else { 0.0 };
                let compliant = 1.0 / (h * config.contact_stiffness * (h + tau_n));
                // Convexity makes a sliding contact hover: the lagged de Saxcé term takes that out again.
                let glide = pair.friction * (point.anchor.slip - config.glide_deadband).max(0.0);
                let stretch = point.anchor.stretch;
                let target = [
                    -stretch.dot(t1) / (h + tau),
                    -stretch.dot(t2) / (h + tau),
                    -point.distance / (h + tau_n) - glide,
                ];
                let normal = 1.0 / near_rigid.max(compliant);
                let law = ConeLaw::new(pair.friction, tangential, normal, target);
                load += point.anchor.normal_force;
                problem.points.push(Point::new(point.r, axes, law));
            }
            let rolling =
                RollingLaw { limit: pair.rolling_friction * load * h, deadband: config.rolling_deadband };
            let end = problem.points.len();
            problem.pairs.push(PairProblem::new(pair.a, pair.b, pair.origin, rolling, first, end));
        }
    }

    /// Mean inverse mass of a body at a point, from the diagonal of A: the scale of near-rigidity.
    fn inverse_mass(&self, owner: Owner, origin: Vec3, r: Vec3) -> f64 {
        let work = &self.work;
        match owner {
            Owner::Static => 0.0,
            Owner::Object(k) => {
                let object = &self.model.objects()[k];
                let arm = origin + r - self.state.objects[k].translation;
                let i = &work.free_turn[k].inertia;
                let (x, y, z) = (arm.x * arm.x, arm.y * arm.y, arm.z * arm.z);
                1.0 / object.mass + ((y + z) / i.x_axis.x + (x + z) / i.y_axis.y + (x + y) / i.z_axis.z) / 3.0
            }
            Owner::Link(link) => {
                let Some(hand) = self.model.hand() else { return 0.0 };
                let n = self.model.hand_dofs();
                let at = origin + r - work.kin.origin;
                let (x, y, z) = (at.x * at.x, at.y * at.y, at.z * at.z);
                let diagonal = |k: usize| work.mass[k * n + k];
                let mut w = 1.0 / diagonal(0)
                    + ((y + z) / diagonal(3) + (x + z) / diagonal(4) + (x + y) / diagonal(5)) / 3.0;
                let mut i = link;
                while let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
                    let k = 6 + joint.coordinate;
                    w += work.kin.screw[i].at(at).length_squared() / (3.0 * diagonal(k));
                    i = parent;
                }
                w
            }
        }
    }

    /// Writes anchors back to the manifolds and the contact forces out.
    fn remember(&mut self, island: &Island, problem: &Problem) {
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
                    *data = Anchor::default();
                    continue;
                }
                let friction = t1 * g1 + t2 * g2;
                // The law saw the stretch's projection on the tangent plane.
                let before = t1 * seen.anchor.stretch.dot(t1) + t2 * seen.anchor.stretch.dot(t2);
                let stretch = stretch_after(before, friction, config.anchor_stiffness, tau, h);
                let slip = point.law.slip_speed(point.velocity, point.impulse);
                let normal_force = gn / h;
                *data = Anchor { loaded: true, stretch: into_a * stretch, slip, normal_force };
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

    /// Semi-implicit Euler: positions move with the velocities of the end of the step.
    fn integrate(&mut self, island: &Island, v: &[f64]) {
        let h = self.model.config().step_s;
        let mut at = 0;
        let state = &mut self.state;
        if island.hand {
            at = self.model.hand_dofs();
            state.v[..at].copy_from_slice(&v[..at]);
            let (linear, angular) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
            state.base.translation += linear * h;
            state.base.rotation = turned(state.base.rotation, angular * h);
            for (q, rate) in state.q.iter_mut().zip(&v[6..at]) {
                *q += h * rate;
            }
        }
        for &k in &island.objects {
            let to = self.model.object_dofs(k);
            let own = &v[at..at + 6];
            state.v[to..to + 6].copy_from_slice(own);
            let pose = &mut state.objects[k];
            pose.translation += Vec3::new(own[0], own[1], own[2]) * h;
            pose.rotation = turned(pose.rotation, Vec3::new(own[3], own[4], own[5]) * h);
            at += 6;
        }
    }

    /// Counts the steps an island has been still, and stops it when they are enough.
    fn fall_asleep(&mut self, island: &Island) {
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

fn push_limit(
    terms: &mut Vec<AxisTerm>,
    config: &crate::config::Config,
    dof: usize,
    sign: f64,
    gap: f64,
    rate: f64,
    inverse_mass: f64,
) {
    let h = config.step_s;
    // Only limits that the step could reach: within 0.05 rad plus what 20 rad/s covers.
    if gap + h * rate >= 0.05 + 20.0 * h {
        return;
    }
    let tau = if gap < 0.0 { h } else { 0.0 };
    let near_rigid = config.near_rigid.powi(2) / (4.0 * std::f64::consts::PI.powi(2)) * inverse_mass;
    let r = near_rigid.max(1.0 / (h * config.limit_stiffness * (h + tau)));
    let law = ScalarLaw::Limit { inverse_regularisation: 1.0 / r, target: -gap / (h + tau) };
    terms.push(AxisTerm { dof, sign, law });
}

fn turned(rotation: Rotation, by: Vec3) -> Rotation {
    (Rotation::from_scaled_axis(by) * rotation).normalize()
}

/// A rigid body's rotation over h without torque: L is constant, `ω = I(R)⁻¹ L`, by one step of the classical
/// fourth-order Runge–Kutta method on the quaternion.
fn torque_free(rotation: Rotation, omega: Vec3, inertia: Mat3, inverse: Mat3, h: f64) -> FreeTurn {
    let isotropic = inertia == Mat3::from_diagonal(Vec3::splat(inertia.x_axis.x));
    let r = Mat3::from_quat(rotation);
    let world = if isotropic { inertia } else { r * inertia * r.transpose() };
    if isotropic || omega == Vec3::ZERO {
        return FreeTurn { inertia: world, rotation: turned(rotation, omega * h), angular: omega };
    }
    let momentum = world * omega;
    let omega_at = |q: Rotation| {
        let r = Mat3::from_quat(q.normalize());
        r * (inverse * (r.transpose() * momentum))
    };
    let rate = |q: Rotation| {
        let w = omega_at(q);
        Rotation::from_xyzw(w.x, w.y, w.z, 0.0) * q * 0.5
    };
    let k1 = rate(rotation);
    let k2 = rate(rotation + k1 * (0.5 * h));
    let k3 = rate(rotation + k2 * (0.5 * h));
    let k4 = rate(rotation + k3 * h);
    let next = (rotation + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)).normalize();
    FreeTurn { inertia: world, rotation: next, angular: omega_at(next) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_free_rotation_keeps_angular_momentum() {
        let inertia = Mat3::from_diagonal(Vec3::new(1.0, 2.0, 3.0));
        let inverse = inertia.inverse();
        let (mut q, mut w) = (Rotation::IDENTITY, Vec3::new(0.1, 5.0, 0.1));
        let momentum = inertia * w;
        for _ in 0..1000 {
            let turn = torque_free(q, w, inertia, inverse, 1e-3);
            (q, w) = (turn.rotation, turn.angular);
        }
        let r = Mat3::from_quat(q);
        let now = r * inertia * r.transpose() * w;
        assert!((now - momentum).length() < 1e-9, "{now}");
    }
}
