//! An object that rolls or slides on the rim of a cylinder.
//!
//! The lowest point of a rim moves over the body. A contact that stays where it was at the start of the step acts at a wrong arm,
//! and stops a point of the body that has gone on: both take energy, in proportion to the step. So the contact acts in the middle of
//! the step, on an object that moves freely before and after:
//!
//! `x₀, v₀ → h/2 without contact → x½, v⁻ → v⁺ = v⁻ + M⁻¹ J½ᵀ γ → h/2 without contact → x₁, v₁`
//!
//! Its work is exactly `γ·J½ (v⁻ + v⁺)/2`, and the motion is the same forwards and backwards. The contact's velocity is `u = J v`
//! with J of its own place at that time. The law is that of the end of the step: it asks for u₁, which is `u⁺ = J½ v⁺` and what
//! the second half adds, `s = u₁ − u⁺`. This is a shift of the law's v̂. The first guess of s is what the first half adds,
//! `u⁻ − u₀`; the step is solved again with what its solution adds. The gap at the end is, with that in the middle,
//! `φ₁ = φ½ + (u⁺ + u₁) h/4 = φ½ + u₁ h/2 − s h/4`.
//!
//! A step in which the object turns far is taken in parts. `coin_rim` has the error.

use super::assemble::assemble;
use super::contact_memory::{bearing, contact_force};
use super::dead_blow::after_step;
use super::impacts::pull;
use super::method::Attempt;
use super::rim::{Lowest, Rim};
use super::slip_correction::{de_saxce, nearness};
use super::solve::solve;
use super::torque_free::torque_free;
use super::work::Work;
use crate::anchor::Anchor;
use crate::contact::narrow_phase::ContactPair;
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::friction_cone::ConeLaw;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::{Point, Problem};
use crate::state::State;
use palmares_models::{Mat3, Pose, Vec3};

/// Largest turn in a part of a step, rad, by the angular velocity and by the pendulum of the radius.
const TURN: f64 = 0.15;

/// Largest number of parts; implicit Euler takes a step that needs more.
const MAX_PARTS: f64 = 32.0;

/// Largest number of repeated solves in a part: each leaves about a tenth of the error.
const PASSES: usize = 3;

/// A part is solved again where the last guess would leave the surface farther off than this, m.
const TOLERANCE_M: f64 = 1e-7;

/// Between the ends of a step, speeds up to this part of those there do not invalidate cached gaps.
const FASTER: f64 = 1.005;

/// Least dissipation time of the contact, as a part of the time of a solve. Without it the normal velocity would change its sign
/// from one to the next and never decay.
const LEAST_DISSIPATION: f64 = 0.125;

/// An object that stands on a rim.
struct Rolling<'a> {
    model: &'a Model,
    rim: Rim<'a>,
    /// Its pair, and the places of this and of its point in the problem.
    pair: ContactPair,
    place: usize,
    point: usize,
    /// 1 if it is the pair's second body, −1 if it is the first.
    sign: f64,
    /// Two tangents and the normal.
    axes: [Vec3; 3],
    /// Acceleration by gravity and forces, m/s², and the torque of these, N·m.
    pull: Vec3,
    torque: Vec3,
    /// Time of a part of the step, s.
    h: f64,
}

/// An object at some time of the step.
#[derive(Clone, Copy)]
struct Motion {
    pose: Pose,
    linear: Vec3,
    angular: Vec3,
}

impl Motion {
    fn at(&self, arm: Vec3) -> Vec3 {
        self.linear + self.angular.cross(arm)
    }
}

/// Steps a lone object that stands on a rim. Declines if another point bears, or may bear within the step.
pub(super) fn step(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
) -> Attempt {
    if !model.has(Law::ObjectOrder) {
        return Attempt::Declined;
    }
    let Some((rim, place, k)) = Rim::find(model, state, work, island) else { return Attempt::Declined };
    let object = rim.object;
    let (linear, angular) = state.object_velocity(model, object);
    let mut motion = Motion { pose: state.objects[object], linear, angular };
    let pull = pull(model, &work.loads, object);
    let turn = angular.length() + (pull.length() / rim.radius).sqrt();
    let step_s = model.config().step_s;
    let parts = (turn * step_s / TURN).ceil().max(1.0);
    if parts > MAX_PARTS {
        return Attempt::Declined;
    }
    assemble(&work.input(model, state), island, step_s, problem, v);
    for other in &mut problem.points {
        other.law.target[2] = f64::NEG_INFINITY;
    }
    let pair = work.collision.contacts.pairs[island.pairs[place]].clone();
    let contact = work.collision.contacts.points[pair.points.start + k];
    let [t1, t2] = contact.tangents;
    let rolling = Rolling {
        model,
        rim,
        sign: if matches!(pair.b, Owner::Object(_)) { 1.0 } else { -1.0 },
        pair,
        place,
        point: problem.pairs[place].first + k,
        axes: [t1, t2, contact.normal],
        pull,
        torque: work.loads.get(object).map_or(Vec3::ZERO, |(_, torque)| *torque),
        h: step_s / parts,
    };
    let (mut anchor, mut impulse, mut lowest) = (contact.anchor, [0.0; 4], None);
    let radius = model.object_radius(object);
    let speed = |motion: &Motion| motion.linear.length() + motion.angular.length() * radius;
    let (at_first, mut fastest) = (speed(&motion), 0.0f64);
    for _ in 0..parts as u32 {
        let Some((end, at_end)) = rolling.part(&motion, &anchor, work, (problem, newton), v) else {
            return Attempt::Declined;
        };
        let point = &problem.points[rolling.point];
        anchor = match point.impulse[2] > 0.0 {
            true => bearing(model.config(), point, &anchor, rolling.h),
            false => Anchor { bearing: anchor.bearing_after(0.0, rolling.h), ..Anchor::IDLE },
        };
        if !model.has(Law::Anchors) {
            anchor.let_go();
        }
        impulse.iter_mut().zip(point.impulse).for_each(|(sum, part)| *sum += part);
        fastest = fastest.max(speed(&end));
        (motion, lowest) = (end, Some(at_end));
    }
    let Some(lowest) = lowest else { return Attempt::Declined };
    anchor.struck_s = after_step(model.config(), anchor.struck_s);
    let solved = &mut problem.points[rolling.point];
    solved.impulse = impulse;
    // Where it is at the end of the step.
    solved.r = motion.pose.translation + lowest.arm - rolling.pair.origin;
    solved.friction_r = solved.r;
    rolling.remember(state, work, island, &motion, (k, anchor), solved);
    // Cached gaps rely on no object moving farther than the faster of its velocities at the ends of the step allows.
    if fastest > FASTER * at_first.max(speed(&motion)) {
        work.collision.distances.forget();
    }
    state.objects[object] = motion.pose;
    let own = &mut state.v[model.object_dofs(object)..][..6];
    own[..3].copy_from_slice(&motion.linear.to_array());
    own[3..].copy_from_slice(&motion.angular.to_array());
    Attempt::Taken
}

impl Rolling<'_> {
    /// Moves the object without contact for half of a part.
    fn fly(&self, from: &Motion) -> Motion {
        let (time_s, object) = (0.5 * self.h, self.rim.object);
        let inertia = self.model.objects()[object].inertia;
        let inverse = self.model.object_inertia_inverse(object);
        let (rotation, angular) = torque_free(from.pose.rotation, from.angular, inertia, inverse, time_s);
        let way = from.linear * time_s + self.pull * (0.5 * time_s * time_s);
        let pose = Pose::from_parts(from.pose.translation + way, rotation);
        Motion { pose, linear: from.linear + self.pull * time_s, angular }
    }

    /// Moves the object for a part of the step, from the memory of its point. Returns it at the end, and its lowest point there.
    /// Velocity and v̂ of the problem's point are then those of the end.
    fn part(
        &self,
        start: &Motion,
        anchor: &Anchor,
        work: &mut Work,
        (problem, newton): (&mut Problem, &mut Newton),
        v: &mut [f64],
    ) -> Option<(Motion, Lowest)> {
        let (config, h) = (self.model.config(), self.h);
        let before = self.fly(start);
        let (at_start, at_middle) = (self.rim.lowest(&start.pose)?, self.rim.lowest(&before.pose)?);
        self.place(&before, anchor, problem, v);
        let (mut added, mut slip) = (before.at(at_middle.arm) - start.at(at_start.arm), anchor.slip);
        for pass in 0.. {
            let shift = self.axes.map(|axis| self.sign * axis.dot(added));
            let law = self.law(anchor, [at_start.gap, at_middle.gap], shift, slip);
            problem.points[self.point] = Point::new(at_middle.arm, at_middle.arm, self.axes, law);
            solve(self.model, work, problem, newton, v);
            let point = &mut problem.points[self.point];
            for (k, shift) in shift.into_iter().enumerate() {
                point.velocity[k] += shift;
                point.law.target[k] += shift;
            }
            let [linear, angular] = [&v[..3], &v[3..6]].map(Vec3::from_slice);
            let after = Motion { pose: before.pose, linear, angular };
            let end = self.fly(&after);
            let at_end = self.rim.lowest(&end.pose)?;
            let adds = end.at(at_end.arm) - after.at(at_middle.arm);
            let slips = point.law.slip_speed(point.velocity, point.impulse);
            let lift = de_saxce(config, &self.pair, slips) - de_saxce(config, &self.pair, slip);
            if pass == PASSES || ((adds - added).length() + lift.abs()) * h < TOLERANCE_M {
                return Some((end, at_end));
            }
            (added, slip) = (adds, slips);
        }
        None
    }

    /// Moves the object of the problem to where its contact acts.
    fn place(&self, before: &Motion, anchor: &Anchor, problem: &mut Problem, v: &mut [f64]) {
        let rotation = Mat3::from_quat(before.pose.rotation);
        let inertia = rotation * self.model.objects()[self.rim.object].inertia * rotation.transpose();
        let solved = &mut problem.objects[0];
        (solved.center, solved.inertia, solved.turn) = (before.pose.translation, inertia, None);
        let momentum = [before.linear * solved.mass, inertia * before.angular + self.torque * self.h];
        problem.momentum.clear();
        problem.momentum.extend(momentum.iter().flat_map(|part| part.to_array()));
        let pair = &mut problem.pairs[self.place];
        pair.origin = before.pose.translation;
        pair.rolling.limit = self.pair.rolling_friction * anchor.normal_force * self.h;
        problem.fresh = true;
        v[..3].copy_from_slice(&before.linear.to_array());
        v[3..6].copy_from_slice(&before.angular.to_array());
    }

    /// The law of the point, for gaps at the start and in the middle, m, a shift of its velocity and its slip, m/s.
    fn law(&self, anchor: &Anchor, [start, middle]: [f64; 2], shift: [f64; 3], slip: f64) -> ConeLaw {
        let (config, h) = (self.model.config(), self.h);
        let (overlap, tau) = (self.pair.initial_overlap, config.contact_dissipation_s);
        let tau_n = tau * nearness(start + overlap, config.contact_onset_m);
        let time_s = 0.5 * h + tau_n.max(LEAST_DISSIPATION * h);
        let gap = middle + overlap - 0.25 * h * shift[2];
        let rest = -gap / time_s - de_saxce(config, &self.pair, slip);
        let pulls_back = anchor.stretch / (h + tau);
        let [t1, t2, _] = self.axes;
        let target = [-pulls_back.dot(t1) - shift[0], -pulls_back.dot(t2) - shift[1], rest - shift[2]];
        let [tangential, normal] =
            [config.anchor_stiffness * (h + tau), config.contact_stiffness * time_s].map(|k| h * k);
        let arm = self.pair.spin.map_or(0.0, |spin| spin.arm(anchor.bearing));
        ConeLaw::new(self.pair.friction, tangential, normal, target).with_spin(arm, -anchor.twist / (h + tau))
    }

    /// Writes the memory of the `k`-th point of the pair and of the idle ones, and its force, whose impulse is that of the step.
    fn remember(
        &self,
        state: &mut State,
        work: &mut Work,
        island: &Island,
        end: &Motion,
        (k, anchor): (usize, Anchor),
        point: &Point,
    ) {
        let step_s = self.model.config().step_s;
        let contacts = &work.collision.contacts;
        for found in island.pairs.iter().map(|&index| &contacts.pairs[index]) {
            let pair = &mut state.pairs[found.pair];
            pair.mean = Anchor::default();
            // The surfaces' points do not stay together.
            pair.predicted = None;
            for contact in &contacts.points[found.points.clone()] {
                pair.manifold.points[contact.point as usize].data =
                    Anchor { bearing: contact.anchor.bearing_after(0.0, step_s), ..Anchor::IDLE };
            }
        }
        let pair = &mut state.pairs[self.pair.pair];
        let first = &self.model.colliders()[pair.key.0 as usize];
        let rotation = match first.owner {
            Owner::Object(_) => end.pose.rotation * first.body_from_shape.rotation,
            Owner::Static | Owner::Link(_) => work.collision.poses[pair.key.0 as usize].rotation,
        };
        let contact = &contacts.points[self.pair.points.start + k];
        let data = Anchor { stretch: rotation.inverse() * anchor.stretch, ..anchor };
        pair.manifold.points[contact.point as usize].data = data;
        if anchor.loaded {
            pair.mean = Anchor { known: false, loaded: false, normal_force: 0.0, ..data };
        }
        if point.impulse[2] > 0.0 {
            work.forces.contacts.push(contact_force(point, contact, &self.pair, pair.key, step_s));
        }
    }
}
