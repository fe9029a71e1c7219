//! Continuous detection: fast bodies, and bodies that turn far, do not pass through others.
//!
//! Contacts are predicted along the directions and with the velocities at the start of a step. A rod whose
//! tip is hit can turn by a radian within the step, so that its other end is beyond a plate at the end of the
//! step. So the motions of fast objects are checked again when all islands are solved. An object whose
//! overlap with another, or with furniture, could exceed half of the thinner one's width stops at a quarter
//! of it ([`crate::contact::advancement`]). It keeps its velocities as seen from the body, so that its energy
//! stays, and the contacts of the next step act on them. The rest of its motion in the step is lost.
//!
//! Links of the hand are exempt: they are thick, and a link cannot stop alone. A ground has no far side.

use crate::bounds::step_work;
use crate::contact::advancement::{Moving, Sweep, free_part, stays_separated};
use crate::contact::broad_phase::separation;
use crate::contact::collide::Collision;
use crate::law::Law;
use crate::model::{Collider, Model, Owner};
use crate::state::State;
use palmares_models::{Pose, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Allowed overlap of objects in a step, as a part of the thinner one's width: beyond it the near side might
/// no longer be the nearer one.
const MAX_OVERLAP: f64 = 0.5;

/// An object that moves less than this part of the limit in a step is left to its contacts.
const SLOW: f64 = 0.25;

/// Largest number of passes: stopped objects may be in the way of others.
const PASSES: usize = 4;

/// The motions of a step's objects.
#[derive(Default)]
pub(crate) struct Continuous {
    /// Poses of the objects at the start.
    starts: Vec<Pose>,
    sweeps: Vec<Sweep>,
    /// Whether each has been stopped.
    stopped: Vec<bool>,
    /// Largest distance that a point of each object moves, m.
    ways: Vec<f64>,
    /// Pairs of shapes to check.
    due: Vec<(usize, usize)>,
}

impl Continuous {
    /// Stores the poses of the objects before they move.
    pub(super) fn begin(&mut self, state: &State) {
        self.starts.clone_from(&state.objects);
    }
}

/// Stops the objects that would pass through others, once all islands have moved; true if there are any. Adds its computing to
/// `spent`.
pub(super) fn stop_short(
    model: &Model,
    state: &mut State,
    continuous: &mut Continuous,
    collision: &Collision,
    spent: &mut u64,
) -> bool {
    if !model.has(Law::ContinuousMotion) {
        return false;
    }
    let Continuous { starts, ways, .. } = continuous;
    ways.clear();
    ways.extend(starts.iter().enumerate().map(|(k, start)| longest_way(model, state, start, k)));
    let farthest = ways.iter().copied().fold(0.0, f64::max);
    if 2.0 * farthest <= SLOW * MAX_OVERLAP * model.thinnest_m() || farthest.is_nan() {
        return false;
    }
    list_due(model, state, continuous, collision, spent);
    if continuous.due.is_empty() {
        return false;
    }
    let h = model.config().step_s;
    let Continuous { starts, sweeps, stopped, .. } = &mut *continuous;
    sweeps.clear();
    sweeps.extend(starts.iter().zip(&state.objects).enumerate().map(|(k, (start, end))| {
        // A sleeping object has not moved.
        if state.sleep[k].asleep {
            return Sweep { start: *start, ..Sweep::default() };
        }
        Sweep::between(*start, *end, state.object_velocity(model, k).1 * h)
    }));
    stopped.clear();
    stopped.resize(model.objects().len(), false);
    let allowed = step_work(model.objects().len());
    for pass in 0..PASSES {
        if pass > 0 {
            list_due(model, state, continuous, collision, spent);
        }
        if !stop_due(model, state, continuous, collision, spent) || *spent > allowed {
            break;
        }
        let Continuous { sweeps, ways, .. } = &mut *continuous;
        for (k, (way, sweep)) in ways.iter_mut().zip(sweeps).enumerate() {
            *way = sweep.way.length() + sweep.turn.length() * model.object_radius(k);
        }
    }
    for (k, sweep) in continuous.sweeps.iter().enumerate() {
        if !continuous.stopped[k] {
            continue;
        }
        let (stop, at) = (sweep.at(1.0), model.object_dofs(k) + 3);
        let back = stop.rotation * state.objects[k].rotation.inverse();
        let angular = &mut state.v[at..at + 3];
        angular.copy_from_slice(&(back * Vec3::from_slice(angular)).to_array());
        state.objects[k] = stop;
    }
    continuous.stopped.contains(&true)
}

/// Largest distance that a point of an object moved in the step, m.
fn longest_way(model: &Model, state: &State, start: &Pose, k: usize) -> f64 {
    if state.sleep[k].asleep {
        return 0.0;
    }
    let end = &state.objects[k];
    let turn = state.object_velocity(model, k).1.length() * model.config().step_s;
    let cosine = start.rotation.dot(end.rotation);
    // An arc of up to half a turn is at most pi/2 times its chord; full turns do not show in the chord.
    let chord = 2.0 * (1.0 - cosine * cosine).max(0.0).sqrt();
    let turned = if turn > 1.0 { turn + PI } else { turn.max(FRAC_PI_2 * chord) };
    start.translation.distance(end.translation) + turned * model.object_radius(k)
}

/// The allowed overlap of two shapes in a step, m.
fn most(a: &Collider, b: &Collider) -> f64 {
    MAX_OVERLAP * a.width.min(b.width)
}

/// Whether a shape takes part.
fn takes_part(shape: &Collider) -> bool {
    !matches!(shape.owner, Owner::Link(_)) && shape.bounding_radius.is_finite()
}

/// Lists the pairs of shapes whose motions could bring them through each other, by distance.
fn list_due(
    model: &Model,
    state: &State,
    continuous: &mut Continuous,
    collision: &Collision,
    spent: &mut u64,
) {
    let Continuous { ways, due, .. } = continuous;
    let colliders = model.colliders();
    let way = |shape: &Collider| match shape.owner {
        Owner::Object(k) => ways[k],
        Owner::Static | Owner::Link(_) => 0.0,
    };
    due.clear();
    let distances = &collision.distances;
    *spent += distances.count() as u64;
    // Near pairs and remembered ones have the same order.
    let mut place = 0;
    for index in 0..distances.count() {
        let (i, j) = distances.key(index);
        let (a, b) = (&colliders[i], &colliders[j]);
        let (way, most, slack) = (way(a) + way(b), most(a, b), distances.slack(index));
        let slow = way <= SLOW * most || slack > 0.0 && way <= slack + most;
        if slow || !takes_part(a) || !takes_part(b) {
            continue;
        }
        let key = (i as u32, j as u32);
        place += state.pairs[place..].iter().take_while(|pair| pair.key < key).count();
        let known = state.pairs.get(place).filter(|pair| pair.key == key && !pair.manifold.points.is_empty());
        if !known.is_some_and(|pair| way <= pair.updated_at.0 + most) {
            due.push((i, j));
        }
    }
    // Near pairs are those that the velocities at the start could bring together.
    let (h, margin) = (model.config().step_s, 0.5 * model.config().margin(false));
    let beyond = |i: usize| (way(&colliders[i]) - h * collision.motion.speeds[i] - margin).max(0.0);
    for i in (0..colliders.len()).filter(|&i| beyond(i) > 0.0) {
        *spent += colliders.len() as u64;
        for (j, other) in colliders.iter().enumerate() {
            // If both shapes qualify, only the first searches.
            if other.owner == colliders[i].owner || j < i && beyond(j) > 0.0 || !takes_part(other) {
                continue;
            }
            let bounds_gap = separation(&collision.bounds[i], &collision.bounds[j]);
            let pair = (i.min(j), i.max(j));
            if bounds_gap <= beyond(i) + beyond(j) && !distances.has((pair.0 as u32, pair.1 as u32)) {
                due.push(pair);
            }
        }
    }
}

/// Stops both objects of every listed pair before they pass through each other; true if there are any.
fn stop_due(
    model: &Model,
    state: &State,
    continuous: &mut Continuous,
    collision: &Collision,
    spent: &mut u64,
) -> bool {
    let Continuous { sweeps, stopped, due, .. } = continuous;
    let mut any = false;
    let allowed = step_work(model.objects().len());
    for &(i, j) in due.iter() {
        if *spent > allowed {
            break;
        }
        let [a, b] = [i, j].map(|i| &model.colliders()[i]);
        let sweep = |shape: &Collider| match shape.owner {
            Owner::Object(k) => sweeps[k],
            Owner::Static | Owner::Link(_) => Sweep::default(),
        };
        let (of_a, of_b) = (sweep(a), sweep(b));
        let (moving_a, moving_b) = (Moving { shape: a, sweep: &of_a }, Moving { shape: b, sweep: &of_b });
        let most = most(a, b);
        // The gap along the normal of an existing contact is known.
        let known = state.pairs.binary_search_by_key(&(i as u32, j as u32), |pair| pair.key);
        let known = known.ok().map(|place| &state.pairs[place]).filter(|p| !p.manifold.points.is_empty());
        let separated = known.is_some_and(|pair| {
            let normal = collision.poses[i].rotation * pair.manifold.local_n1;
            stays_separated(moving_a, moving_b, normal, pair.updated_at.0, most)
        });
        if separated {
            continue;
        }
        let part = free_part(moving_a, moving_b, most, spent);
        if part >= 1.0 {
            continue;
        }
        any = true;
        for shape in [a, b] {
            if let Owner::Object(k) = shape.owner {
                sweeps[k].shorten(part);
                stopped[k] = true;
            }
        }
    }
    any
}
