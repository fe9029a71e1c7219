//! One step: forces and contacts at the start, one convex solve for the velocities at the end, integration.

mod explicit;
mod free;
mod impacts;
mod island;
mod mean;
mod pose;
mod smooth;

pub(crate) use explicit::Stages;
pub(crate) use impacts::Met;

use crate::actuation::base::{self, BaseCommand};
use crate::actuation::motor;
use crate::bounds::{Fault, STEP_WORK, hand_work};
use crate::contact::broad::tight_bounds;
use crate::dynamics::jacobian::add_point_force;
use crate::dynamics::spatial::Motion;
use crate::model::{Model, Owner};
use crate::state::BaseReference;
use crate::world::{Command, Outcome, Phase, Probe, Workspace, World};
use palmares_models::{Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;

impl World {
    /// Advances the world by one step.
    pub fn step(&mut self, command: &Command) -> &Outcome {
        self.step_probed(command, &mut ())
    }

    /// Advances the world by one step and tells `probe` when a phase is over. A world with a [`Fault`] stands still.
    pub fn step_probed(&mut self, command: &Command, probe: &mut impl Probe) -> &Outcome {
        self.begin(probe);
        self.work.begun = false;
        if self.fault.is_some() {
            self.outcome = Outcome::default();
            return &self.outcome;
        }
        self.actuate(command);
        add_pushes(&self.model, &mut self.work);
        self.solve();
        if self.outcome.work > STEP_WORK {
            self.fault = Some(Fault::WorkExhausted);
        }
        self.state.step += 1;
        probe.ended(Phase::Solver);
        &self.outcome
    }

    /// Does now what the next step does before its command matters: the hand's dynamics and the search for contacts. The
    /// step that follows gives the same bits, sooner. Until then the state's contact memory is that of a step half done:
    /// take snapshots and hashes before.
    pub fn prepare(&mut self) {
        self.begin(&mut ());
    }

    fn begin(&mut self, probe: &mut impl Probe) {
        if self.work.begun {
            return;
        }
        self.work.begun = true;
        self.fault = self.fault();
        if self.fault.is_some() {
            return;
        }
        let links = self.model.hand().map_or(0, |hand| hand.links.len());
        self.work.spent = hand_work(links, self.model.hand_dofs());
        hand_dynamics(&self.model, &mut self.work, false, self.state.base, &self.state.q, &self.state.v);
        probe.ended(Phase::Dynamics);
        self.collide();
        if self.work.spent > STEP_WORK {
            self.fault = Some(Fault::WorkExhausted);
        }
        probe.ended(Phase::Collision);
    }

    fn actuate(&mut self, command: &Command) {
        let Some(hand) = self.model.hand() else { return };
        self.work.pushes.clear();
        self.work.pushes.extend_from_slice(&command.pushes);
        self.work.servo_on = command.base != BaseCommand::Free;
        self.work.held = self.work.servo_on && self.model.config().base.bolted;
        if !self.work.servo_on {
            let (linear, angular) = (self.state.v[..3].as_chunks().0[0], self.state.v[3..6].as_chunks().0[0]);
            let (linear, angular) = (Vec3::from_array(linear), Vec3::from_array(angular));
            self.state.reference = BaseReference { pose: self.state.base, linear, angular };
        }
        let h = self.model.config().step_s;
        base::advance(self.model.config(), self.state.base, &mut self.state.reference, &command.base);
        for (i, motor) in hand.motors.iter().enumerate() {
            let state = &mut self.state.motors[i];
            let sigma = command.sigma.get(i).copied().unwrap_or(state.command);
            motor::advance(motor, state, sigma, h);
        }
    }

    /// Bounds, near pairs, contact points; sleepers that are touched wake, and with them what they touch.
    fn collide(&mut self) {
        if self.model.colliders().is_empty() {
            return;
        }
        let (model, state, work) = (&self.model, &mut self.state, &mut self.work);
        let (h, margin) = (model.config().step_s, 0.5 * model.config().margin(false));
        let fresh = work.bounds.len() != model.colliders().len();
        if fresh {
            work.poses.resize(model.colliders().len(), Pose::IDENTITY);
            work.bounds.resize(model.colliders().len(), Aabb::new_invalid());
        }
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
        std::mem::swap(&mut work.speeds, &mut work.speeds_before);
        work.speeds.clear();
        for (i, collider) in model.colliders().iter().enumerate() {
            let pose = match collider.owner {
                // Furniture is where it was.
                Owner::Static if !fresh => {
                    work.speeds.push(0.0);
                    continue;
                }
                Owner::Static => collider.body_from_shape,
                Owner::Link(i) => work.kin.pose[i] * collider.body_from_shape,
                Owner::Object(k) => centers[k] * collider.body_from_shape,
            };
            let speed = if collider.owner == Owner::Static {
                0.0
            } else {
                let motion = velocity(collider.owner, pose.translation);
                motion.linear.length() + motion.angular.length() * collider.reach
            };
            work.bounds[i] = tight_bounds(&collider.local_bounds, &pose, margin + h * speed);
            work.poses[i] = pose;
            work.speeds.push(speed);
        }
        if work.broad.update(model, &work.bounds, &mut state.pairs) {
            work.near.follow(&state.pairs);
            work.spent += (model.colliders().len() * model.colliders().len()) as u64;
        }
        // Nothing moved farther in the last step than at the faster of its two speeds, but for what gravity adds
        // to a ballistic way and rounding.
        let fall = model.config().gravity.length() * h * h;
        // And a hand's step begins with a third of the way of the last one.
        work.paths.resize(work.speeds.len(), f64::INFINITY);
        let known = work.speeds_before.len() == work.speeds.len();
        if known {
            let faster = work.speeds.iter().zip(&work.speeds_before).map(|(a, b)| a.max(*b));
            for ((path, speed), collider) in work.paths.iter_mut().zip(faster).zip(model.colliders()) {
                let own = if speed > 0.0 { 1.01 * h * speed + fall } else { 0.0 };
                let linked = matches!(collider.owner, Owner::Link(_)) && path.is_finite();
                *path = if linked { own.max((*path + 2.0 * own) / 3.0) } else { own };
            }
        } else {
            work.paths.fill(f64::INFINITY);
            work.near.forget(work.speeds.len());
        }
        let from_rest = model.config().from_rest(false);
        let reach = work.speeds.iter().map(|speed| 2.0 * h * speed + 0.5 * from_rest);
        work.near.travel(if known { &work.paths } else { &[] }, reach);
        // Every round but the last wakes an object at least.
        loop {
            let sleep = &state.sleep;
            work.spent += work.contacts.find(
                model,
                &work.poses,
                &work.bounds,
                &work.speeds,
                &mut work.near,
                work.kin.origin,
                &state.objects,
                |owner| match owner {
                    Owner::Static => false,
                    Owner::Link(_) => true,
                    Owner::Object(k) => !sleep[k].asleep,
                },
                velocity,
                &mut state.pairs,
                STEP_WORK.saturating_sub(work.spent),
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
            if !woken || work.spent > STEP_WORK {
                break;
            }
        }
    }

    fn solve(&mut self) {
        let mut islands = std::mem::take(&mut self.work.islands);
        islands.update(&self.model, &self.work.contacts);
        self.work.forces.clear();
        self.work.limits.clear();
        self.work.met.resize(self.model.objects().len(), None);
        self.outcome = Outcome {
            converged: true,
            points: self.work.contacts.points.len(),
            work: self.work.spent,
            ..Outcome::default()
        };
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
            if self.outcome.work > STEP_WORK {
                break;
            }
            if !island.hand && island.pairs.is_empty() {
                self.fly(island.objects[0]);
            } else {
                self.solve_island(island, used);
                used += 1;
            }
            self.fall_asleep(island);
        }
        self.work.loads.clear();
        self.outcome.islands = used;
        self.outcome.asleep = self.state.sleep.iter().filter(|sleep| sleep.asleep).count();
        self.work.islands = islands;
    }
}

/// Kinematics, mass matrix and bias of the hand at a configuration, into the workspace. Of a hand that is `held` by its
/// base, which is where it was, the joints' part of the mass matrix alone.
fn hand_dynamics(model: &Model, work: &mut Workspace, held: bool, base: Pose, q: &[f64], v: &[f64]) {
    let Some(hand) = model.hand() else { return };
    let n = model.hand_dofs();
    let Workspace { kin, inertias, recursion, mass, bias, .. } = work;
    mass.resize(n * n, 0.0);
    bias.resize(n, 0.0);
    if held {
        kin.update_joints(hand, q);
        inertias.update(hand, kin, 1);
        inertias.joint_matrix(hand, kin, mass);
    } else {
        kin.update(hand, base, q);
        inertias.update(hand, kin, 0);
        inertias.mass_matrix(hand, kin, mass);
    }
    recursion.bias(hand, kin, inertias, &v[..n], model.config().gravity, bias);
}

/// Adds the forces from outside to the bias.
fn add_pushes(model: &Model, work: &mut Workspace) {
    let Some(hand) = model.hand() else { return };
    for push in &work.pushes {
        let point = work.kin.pose[push.link].transform_point(push.point);
        add_point_force(hand, &work.kin, push.link, point, push.force, -1.0, &mut work.bias);
    }
}
