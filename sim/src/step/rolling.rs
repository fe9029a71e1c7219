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
//! The energy of a rolling coin changes by a hundredth of a percent a second at 1 ms and by two tenths at 16 ms (`coin_rim`).

use super::assemble::assemble;
use super::contact_memory;
use super::impacts::pull;
use super::method::Attempt;
use super::slip_correction::{de_saxce, rest_target};
use super::solve::solve;
use super::torque_free::torque_free;
use super::work::Work;
use crate::config::Config;
use crate::contact::narrow_phase::{ContactPair, ContactPoint};
use crate::model::{Collider, Model, Owner};
use crate::solver::friction_cone::ConeLaw;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::{Point, Problem};
use crate::state::State;
use crate::surface::solid::{Solid, farthest};
use palmares_models::{Mat3, Pose, Vec3};

/// Sine of the tilt below which a cap bears with its corners, too.
const FLAT: f64 = 0.02;

/// A point within this distance of the rim's lowest one is that point, m.
const SAME_M: f64 = 1e-6;

/// Largest number of repeated solves.
const PASSES: usize = 3;

/// The step is solved again where the last guess would leave the surface farther off than this, m.
const TOLERANCE_M: f64 = 1e-7;

/// Least dissipation time of the contact as a part of the step. Without it the normal velocity would change its sign from step to
/// step and never decay.
const LEAST_DISSIPATION: f64 = 0.125;

/// The rim that touches furniture, and the plane of that.
struct Rim<'a> {
    object: usize,
    of_object: &'a Collider,
    radius: f64,
    /// Height of its cap along the cylinder's axis, m.
    cap: f64,
    furniture: &'a Collider,
    /// Pose of the furniture, and the index of its face.
    ground: (Pose, Option<u32>),
    /// Unit normal of the plane, towards the object, and a point on it.
    normal: Vec3,
    on_plane: Vec3,
    /// Smallest height of the other cap's rim over this one's lowest point, m.
    clearance: f64,
}

/// An object at some time of the step.
#[derive(Clone, Copy)]
struct Motion {
    pose: Pose,
    linear: Vec3,
    angular: Vec3,
}

/// The lowest point of the rim.
#[derive(Clone, Copy)]
struct Lowest {
    /// From the centre of mass, m.
    arm: Vec3,
    gap: f64,
}

impl Motion {
    /// The same without contact after a time, s, under an acceleration by gravity and forces.
    fn after(self, model: &Model, object: usize, pull: Vec3, time_s: f64) -> Motion {
        let Motion { mut pose, linear, angular } = self;
        pose.translation += linear * time_s + pull * (0.5 * time_s * time_s);
        let inertia = model.objects()[object].inertia;
        let inverse = model.object_inertia_inverse(object);
        let (rotation, angular) = torque_free(pose.rotation, angular, inertia, inverse, time_s);
        pose.rotation = rotation;
        Motion { pose, linear: linear + pull * time_s, angular }
    }

    fn at(&self, arm: Vec3) -> Vec3 {
        self.linear + self.angular.cross(arm)
    }
}

impl Rim<'_> {
    /// The lowest point in a pose of the object; `None` if more than this point may touch there.
    fn lowest(&self, pose: &Pose) -> Option<Lowest> {
        let shape = *pose * self.of_object.body_from_shape;
        let down = shape.rotation.inverse() * -self.normal;
        let at = farthest(self.radius, self.cap, down);
        let place = shape.transform_point(at) - self.normal * self.of_object.rounding;
        let other = 2.0 * self.cap * down.y;
        let tilted = down.x * down.x + down.z * down.z > FLAT * FLAT;
        let on_face = self.ground.1.is_none_or(|face| {
            let foot = self.ground.0.inverse_transform_point(place - self.normal * self.furniture.rounding);
            self.furniture.solid.is_over(face, foot) && self.furniture.seams.is_bare(face, foot)
        });
        let gap = (place - self.on_plane).dot(self.normal);
        (other > self.clearance && tilted && on_face).then_some(Lowest { arm: place - pose.translation, gap })
    }
}

/// The rim on which the object of an island stands alone, and its point's index in its pair.
fn find<'a>(model: &'a Model, state: &State, work: &Work, island: &Island) -> Option<(Rim<'a>, usize)> {
    let [index] = island.pairs[..] else { return None };
    let pair = &work.collision.contacts.pairs[index];
    let found = &work.collision.contacts.points[pair.points.clone()];
    let known = &state.pairs[pair.pair];
    let shapes = [known.key.0, known.key.1].map(|i| i as usize);
    let ((object, of_object), (furniture, own), second) = match (pair.a, pair.b) {
        (Owner::Static, Owner::Object(k)) => ((k, shapes[1]), (shapes[0], known.facing.of_first()), true),
        (Owner::Object(k), Owner::Static) => ((k, shapes[0]), (shapes[1], known.facing.of_second()), false),
        _ => return None,
    };
    let [shape, plane] = [of_object, furniture].map(|i| &model.colliders()[i]);
    let Solid::Cylinder { radius, half_length } = shape.solid else { return None };
    let endless = matches!(plane.solid, Solid::HalfSpace { .. });
    if !(endless || own.is_some()) {
        return None;
    }
    let (k, bears) = bearing(pair, found, model.config())?;
    let on_shape = &known.manifold.points[bears.point as usize];
    let (at, on_plane) =
        if second { (on_shape.local_p2, on_shape.local_p1) } else { (on_shape.local_p1, on_shape.local_p2) };
    let ground = work.collision.poses[furniture];
    let normal = if second { bears.normal } else { -bears.normal };
    let down = work.collision.poses[of_object].rotation.inverse() * -normal;
    let rim = Rim {
        object,
        of_object: shape,
        radius,
        cap: half_length.copysign(down.y),
        furniture: plane,
        ground: (ground, own),
        normal,
        on_plane: ground.transform_point(on_plane),
        clearance: model.config().contact_onset_m,
    };
    let lowest = farthest(radius, rim.cap, down) + down * shape.rounding;
    (lowest.distance_squared(at) < SAME_M * SAME_M).then_some((rim, k))
}

/// The one point of a pair that bears, or that is near without a blow while none bears.
fn bearing<'a>(
    pair: &ContactPair,
    points: &'a [ContactPoint],
    config: &Config,
) -> Option<(usize, &'a ContactPoint)> {
    let loaded = points.iter().any(|point| point.anchor.loaded);
    let bears = |point: &ContactPoint| {
        if loaded {
            point.anchor.loaded
        } else {
            point.distance + pair.initial_overlap <= config.contact_onset_m
        }
    };
    let mut bearing = points.iter().enumerate().filter(|(_, point)| bears(point));
    let found = bearing.next().filter(|(_, point)| point.approach > -config.rebound_speed)?;
    bearing.next().is_none().then_some(found)
}

/// Steps a lone object that stands on a rim. Declines if another point bears, or may bear at the end of the step.
pub(super) fn step(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
) -> Attempt {
    let Some((rim, k)) = find(model, state, work, island) else { return Attempt::Declined };
    let h = model.config().step_s;
    let pull = pull(model, &work.loads, rim.object);
    let (linear, angular) = state.object_velocity(model, rim.object);
    let start = Motion { pose: state.objects[rim.object], linear, angular };
    let before = start.after(model, rim.object, pull, 0.5 * h);
    let (Some(at_start), Some(at_middle)) = (rim.lowest(&start.pose), rim.lowest(&before.pose)) else {
        return Attempt::Declined;
    };
    assemble(&work.input(model, state), island, h, problem, v);
    let torque = work.loads.get(rim.object).map_or(Vec3::ZERO, |(_, torque)| *torque);
    place(model, (rim.object, &before), torque * h, problem, v);
    let pair = &work.collision.contacts.pairs[island.pairs[0]];
    let bearing = work.collision.contacts.points[pair.points.start + k].anchor.bearing;
    let flattened = pair.spin.map_or(0.0, |spin| spin.arm(bearing));
    for (i, point) in problem.points.iter_mut().enumerate() {
        if i == k {
            (point.r, point.friction_r) = (at_middle.arm, at_middle.arm);
            // Of a patch of one point.
            point.law.arm = flattened;
        } else {
            point.law.target[2] = f64::NEG_INFINITY;
        }
    }
    let first = before.at(at_middle.arm) - start.at(at_start.arm);
    let Some((end, at_end)) =
        settle(model, work, island, (problem, newton), v, (&rim, k), (&before, &at_middle), first)
    else {
        return Attempt::Declined;
    };
    let Work { collision, impacts, forces, .. } = work;
    let pair = &collision.contacts.pairs[island.pairs[0]];
    let point = &mut problem.points[k];
    // Where it is at the end of the step.
    point.r = end.pose.translation + at_end.arm - pair.origin;
    point.friction_r = point.r;
    let impacts = &mut impacts.of_objects;
    contact_memory::remember(model, collision, island, problem, &mut state.pairs, impacts, forces);
    // The surfaces' points do not stay together.
    state.pairs[pair.pair].predicted = None;
    state.objects[rim.object] = end.pose;
    let own = &mut state.v[model.object_dofs(rim.object)..][..6];
    own[..3].copy_from_slice(&end.linear.to_array());
    own[3..].copy_from_slice(&end.angular.to_array());
    Attempt::Taken
}

/// Moves the object of a problem to where it is before its contact acts.
fn place(
    model: &Model,
    (object, before): (usize, &Motion),
    turned: Vec3,
    problem: &mut Problem,
    v: &mut [f64],
) {
    let rotation = Mat3::from_quat(before.pose.rotation);
    let inertia = rotation * model.objects()[object].inertia * rotation.transpose();
    let solved = &mut problem.objects[0];
    (solved.center, solved.inertia, solved.turn) = (before.pose.translation, inertia, None);
    let momentum = [before.linear * solved.mass, inertia * before.angular + turned];
    problem.momentum.clear();
    problem.momentum.extend(momentum.iter().flat_map(|part| part.to_array()));
    problem.pairs[0].origin = before.pose.translation;
    v[..3].copy_from_slice(&before.linear.to_array());
    v[3..6].copy_from_slice(&before.angular.to_array());
}

/// Solves until the law's contact velocity is that of the end of the step. Returns the object there, and its lowest point. The
/// velocity and v̂ of the `k`-th point are then those of the end.
#[allow(clippy::too_many_arguments)]
fn settle(
    model: &Model,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut [f64],
    (rim, k): (&Rim<'_>, usize),
    (before, at_middle): (&Motion, &Lowest),
    first: Vec3,
) -> Option<(Motion, Lowest)> {
    let config = model.config();
    let h = config.step_s;
    let pull = pull(model, &work.loads, rim.object);
    let law = problem.points[k].law;
    let (mut added, mut slip) = (first, None);
    for pass in 0.. {
        let pair = &work.collision.contacts.pairs[island.pairs[0]];
        let found = &work.collision.contacts.points[pair.points.start + k];
        let lifted = |slip: f64| de_saxce(config, pair, slip);
        let slipped = slip.unwrap_or(found.anchor.slip);
        let sign = if matches!(pair.b, Owner::Object(_)) { 1.0 } else { -1.0 };
        let shift = problem.points[k].axes.map(|axis| sign * axis.dot(added));
        let tau = rest_target(config, pair, found).1.max(LEAST_DISSIPATION * h);
        let gap = at_middle.gap + pair.initial_overlap - 0.25 * h * shift[2];
        let rest = -gap / (0.5 * h + tau) - lifted(slipped);
        let stiff = h * config.contact_stiffness * (0.5 * h + tau);
        let target = [law.target[0], law.target[1], rest];
        let point = &mut problem.points[k];
        point.law =
            ConeLaw::new(law.friction, law.tangential, stiff, target).with_spin(law.arm, law.target[3]);
        shifted(point, shift, -1.0);
        solve(model, work, problem, newton, v);
        let point = &mut problem.points[k];
        shifted(point, shift, 1.0);
        point.velocity.iter_mut().zip(shift).for_each(|(velocity, shift)| *velocity += shift);
        let [linear, angular] = [&v[..3], &v[3..6]].map(Vec3::from_slice);
        let after = Motion { pose: before.pose, linear, angular };
        let end = after.after(model, rim.object, pull, 0.5 * h);
        let at_end = rim.lowest(&end.pose)?;
        let adds = end.at(at_end.arm) - after.at(at_middle.arm);
        let slips = point.law.slip_speed(point.velocity, point.impulse);
        let pair = &work.collision.contacts.pairs[island.pairs[0]];
        let lift = (de_saxce(config, pair, slips) - de_saxce(config, pair, slipped)).abs();
        let off = (adds - added).length() + lift;
        if pass == PASSES || off * h < TOLERANCE_M {
            return Some((end, at_end));
        }
        (added, slip) = (adds, Some(slips));
    }
    None
}

/// Adds a shift, m/s, so many times to v̂ of a point.
fn shifted(point: &mut Point, shift: [f64; 3], times: f64) {
    point.law.target.iter_mut().zip(shift).for_each(|(target, shift)| *target += times * shift);
}
