//! Continuous detection: what is fast, or turns far, passes through nothing.
//!
//! Contacts are foreseen along the directions and with the velocities of the start of a step. A rod whose tip is hit turns by a
//! radian within the step, and its other end is on the far side of a plate at its end. So the motions of fast objects are looked at
//! once more when all islands are solved. An object that could come to overlap another, or furniture, by more than half of the
//! thinner one's width stops where it does so by a quarter ([`crate::contact::advancement`]), with the velocities it has, seen from
//! the body, so that its energy stays: the next step's contacts take them. What it would still have moved in the step is lost.
//!
//! Links of the hand take no part: they are thick, and a link cannot stop alone. Nor does a ground, which has no far side.

use crate::bounds::step_work;
use crate::contact::advancement::{Moving, Sweep, free_part, stays_apart};
use crate::contact::broad_phase::separation;
use crate::contact::collide::Collision;
use crate::model::{Collider, Model, Owner};
use crate::state::State;
use palmares_models::{Pose, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Objects may come to overlap by this part of the thinner one's width in a step: beyond it the near side might not be the nearer one
/// any more.
const DEEPEST: f64 = 0.5;

/// What goes less far in a step than this part of that is left to its contacts.
const SLOW: f64 = 0.25;

/// What stops may be in the way of others: so often all is looked at again at most.
const PASSES: usize = 4;

/// The motions of a step's objects.
#[derive(Default)]
pub(crate) struct Continuous {
    /// Where the objects start.
    starts: Vec<Pose>,
    sweeps: Vec<Sweep>,
    /// Which of them have been stopped.
    stopped: Vec<bool>,
    /// How far any point of each object goes at most, m.
    ways: Vec<f64>,
    /// Pairs of shapes that have to be looked at.
    due: Vec<(usize, usize)>,
}

impl Continuous {
    /// Remembers where the objects are before they move.
    pub(super) fn begin(&mut self, state: &State) {
        self.starts.clone_from(&state.objects);
    }
}

/// Stops the objects that would pass through something; all islands have moved. Adds what it takes to `spent`.
pub(super) fn stop_short(
    model: &Model,
    state: &mut State,
    continuous: &mut Continuous,
    collision: &Collision,
    spent: &mut u64,
) {
    let Continuous { starts, ways, .. } = continuous;
    ways.clear();
    ways.extend(starts.iter().enumerate().map(|(k, start)| longest_way(model, state, start, k)));
    let farthest = ways.iter().copied().fold(0.0, f64::max);
    if 2.0 * farthest <= SLOW * DEEPEST * model.thinnest_m() || farthest.is_nan() {
        return;
    }
    list_due(model, state, continuous, collision, spent);
    if continuous.due.is_empty() {
        return;
    }
    let h = model.config().step_s;
    let Continuous { starts, sweeps, stopped, .. } = &mut *continuous;
    sweeps.clear();
    sweeps.extend(starts.iter().zip(&state.objects).enumerate().map(|(k, (start, end))| {
        // What is at rest has moved by nothing.
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
}

/// How far any point of an object went at most in the step, m.
fn longest_way(model: &Model, state: &State, start: &Pose, k: usize) -> f64 {
    if state.sleep[k].asleep {
        return 0.0;
    }
    let end = &state.objects[k];
    let turn = state.object_velocity(model, k).1.length() * model.config().step_s;
    let cosine = start.rotation.dot(end.rotation);
    // An arc of up to half a turn is at most pi/2 times its chord; of longer turns whole ones are not seen in it.
    let chord = 2.0 * (1.0 - cosine * cosine).max(0.0).sqrt();
    let turned = if turn > 1.0 { turn + PI } else { turn.max(FRAC_PI_2 * chord) };
    start.translation.distance(end.translation) + turned * model.object_radius(k)
}

/// The overlap that two shapes may come to in a step, m.
fn most(a: &Collider, b: &Collider) -> f64 {
    DEEPEST * a.width.min(b.width)
}

/// Whether a shape takes part.
fn takes_part(shape: &Collider) -> bool {
    !matches!(shape.owner, Owner::Link(_)) && shape.bounding_radius.is_finite()
}

/// Lists the pairs of shapes that their motions could bring through each other, by how far they go.
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
    // Near pairs and remembered ones ascend alike.
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
        if !known.is_some_and(|pair| way <= pair.seen.0 + most) {
            due.push((i, j));
        }
    }
    // Near pairs are those that the velocities of the start could bring together.
    let (h, margin) = (model.config().step_s, 0.5 * model.config().margin(false));
    let beyond = |i: usize| (way(&colliders[i]) - h * collision.speeds[i] - margin).max(0.0);
    for i in (0..colliders.len()).filter(|&i| beyond(i) > 0.0) {
        *spent += colliders.len() as u64;
        for (j, other) in colliders.iter().enumerate() {
            // Of two such shapes the first looks for the second.
            if other.owner == colliders[i].owner || j < i && beyond(j) > 0.0 || !takes_part(other) {
                continue;
            }
            let parted = separation(&collision.bounds[i], &collision.bounds[j]);
            let pair = (i.min(j), i.max(j));
            if parted <= beyond(i) + beyond(j) && !distances.has((pair.0 as u32, pair.1 as u32)) {
                due.push(pair);
            }
        }
    }
}

/// Stops both objects of every listed pair where they would pass through each other; true if there are any.
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
        // Along the normal of their contact it is known already how far apart they were.
        let known = state.pairs.binary_search_by_key(&(i as u32, j as u32), |pair| pair.key);
        let known = known.ok().map(|place| &state.pairs[place]).filter(|p| !p.manifold.points.is_empty());
        let apart = known.is_some_and(|pair| {
            let normal = collision.poses[i].rotation * pair.manifold.local_n1;
            stays_apart(moving_a, moving_b, normal, pair.seen.0, most)
        });
        if apart {
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
