//! Contacts that a step reaches although its search has left them out ([`crate::contact::left_out`]).
//!
//! The search leaves out what only a long way within the step reaches. Between two islands nothing stays left out ([`at_once`]),
//! since each is solved and moved on its own; nor does anything below a lone object, which has few points, and whose impacts and
//! supports are found before it is solved. Within other islands the solution decides, before anything moves: what it hits joins
//! ([`reached`]), and the island is solved again.

use super::resolve_scratch::Joining;
use super::work::Work;
use crate::contact::bodies::Bodies;
use crate::contact::collide::Collision;
use crate::contact::left_out::{Ends, LeftOut, leaves_out};
use crate::contact::narrow_phase::Shapes;
use crate::contact::reach::SHORT_M;
use crate::model::{Model, Owner};
use crate::solver::island::{Island, Islands};
use crate::state::State;
use palmares_models::Vec3;

/// Lets join what cannot wait for a solution, which may unite islands, and gives each island the rest.
pub(super) fn at_once(model: &Model, state: &mut State, work: &mut Work, islands: &mut Islands) {
    let Work { collision, joining, .. } = work;
    let list = &collision.contacts.left_out.list;
    if list.is_empty() {
        islands.distribute(list, |left| owners(model, collision, left));
        return;
    }
    let mut hit = std::mem::take(&mut joining.hit);
    hit.clear();
    let owners_of = |left: &LeftOut| owners(model, collision, left);
    hit.extend((0..list.len()).filter(|&k| islands.cannot_wait(owners_of(&list[k]))));
    for &k in &hit {
        join(model, state, work, k);
    }
    if !hit.is_empty() {
        islands.update(model, &work.collision.contacts);
    }
    work.joining.hit = hit;
    let collision = &work.collision;
    islands.distribute(&collision.contacts.left_out.list, |left| owners(model, collision, left));
}

/// The bodies between which something is left out.
fn owners(model: &Model, collision: &Collision, left: &LeftOut) -> [Owner; 2] {
    let (i, j) = collision.distances.key(left.index);
    [i, j].map(|shape| model.colliders()[shape].owner)
}

/// Lets join what an island reaches with the velocities `v` at the end of the step; true if anything joins.
pub(super) fn reached(
    model: &Model,
    state: &mut State,
    work: &mut Work,
    island: &mut Island,
    v: &[f64],
) -> bool {
    if nothing_waits(model, island) {
        return false;
    }
    find_hit(model, state, work, island, v, &state.v);
    let hit = std::mem::take(&mut work.joining.hit);
    let mut any = false;
    for &k in &hit {
        if let Some(index) = join(model, state, work, k) {
            any = true;
            if let Err(place) = island.pairs.binary_search(&index) {
                island.pairs.insert(place, index);
            }
        }
    }
    if !hit.is_empty() {
        let list = &work.collision.contacts.left_out.list;
        island.left_out.retain(|&k| !list[k].joined);
    }
    work.joining.hit = hit;
    any
}

/// Whether nothing is left out of an island, nor any pair of the hand, which is not listed before there is a solution.
pub(super) fn nothing_waits(model: &Model, island: &Island) -> bool {
    island.left_out.is_empty() && !(island.hand && leaves_out(model))
}

/// Whether the hand alone reaches something with the velocities `v` at the end of the step and `start` at its start.
pub(super) fn hand_reaches(
    model: &Model,
    state: &State,
    work: &mut Work,
    island: &Island,
    v: &[f64],
    start: &[f64],
) -> bool {
    find_hit(model, state, work, island, v, start);
    !work.joining.hit.is_empty()
}

/// Upper bound of the change of the speed of any point of the hand, m/s, between two of its velocities.
fn change_of_hand(model: &Model, work: &mut Work, v: &[f64], start: &[f64]) -> f64 {
    let (Some(hand), Work { collision, dynamics, joining, .. }) = (model.hand(), work) else { return 0.0 };
    let kin = &dynamics.kin;
    let (mut squared, mut radius) = (0.0_f64, 0.0_f64);
    for (shape, pose) in model.colliders().iter().zip(&collision.poses) {
        if matches!(shape.owner, Owner::Link(_)) {
            squared = squared.max(pose.translation.distance_squared(kin.origin));
            radius = radius.max(shape.bounding_radius);
        }
    }
    let size = squared.sqrt() + radius;
    let length = |x: Vec3| x.abs().element_sum();
    let change = |k: usize| v[k] - start[k];
    let [linear, angular] = [0, 3].map(|k| Vec3::new(change(k), change(k + 1), change(k + 2)));
    let changes = &mut joining.changes;
    changes.clear();
    changes.push(length(linear) + size * length(angular));
    let mut most = changes[0];
    for (link, screw) in hand.links.iter().zip(&kin.screw).skip(1) {
        let own = match &link.joint {
            Some(joint) => {
                change(6 + joint.coordinate).abs() * (length(screw.linear) + size * length(screw.angular))
            }
            None => 0.0,
        };
        let sum = link.parent.map_or(0.0, |parent| changes[parent]) + own;
        changes.push(sum);
        most = most.max(sum);
    }
    most
}

/// Upper bound of the change of the speed of any point of an island, m/s, from the velocities `start` of all bodies to its own `v`.
fn change(model: &Model, work: &mut Work, island: &Island, v: &[f64], start: &[f64]) -> f64 {
    let mut at = if island.hand { model.hand_dofs() } else { 0 };
    let mut most = if island.hand { change_of_hand(model, work, v, start) } else { 0.0 };
    for &k in &island.objects {
        let (own, before) = (&v[at..at + 6], &start[model.object_dofs(k)..][..6]);
        let size = |of: std::ops::Range<usize>| of.map(|i| (own[i] - before[i]).powi(2)).sum::<f64>().sqrt();
        most = most.max(size(0..3) + size(3..6) * model.object_radius(k));
        at += 6;
    }
    most
}

/// Lists what an island hits of what was left out of it.
fn find_hit(model: &Model, state: &State, work: &mut Work, island: &Island, v: &[f64], start: &[f64]) {
    work.joining.hit.clear();
    let h = model.config().step_s;
    if nothing_waits(model, island) || 2.0 * h * change(model, work, island, v, start) <= SHORT_M {
        return;
    }
    let Work { joining, collision, dynamics, outcome, .. } = work;
    let Joining { v: ends, links, changes, ways, speeds, hit } = joining;
    let Collision { contacts, poses, distances, motion, .. } = collision;
    let left_out = &mut contacts.left_out;
    let first = left_out.list.len();
    if island.hand {
        let shapes = model.colliders();
        ways.clear();
        ways.extend(motion.speeds.iter().enumerate().map(|(slot, speed)| {
            let change = match shapes[slot % shapes.len()].owner {
                Owner::Link(i) => changes[i],
                Owner::Static | Owner::Object(_) => 0.0,
            };
            h * (speed + change)
        }));
        distances.waiting(ways).for_each(|(index, gap)| left_out.shapes(index, gap));
    }
    if island.left_out.is_empty() && left_out.list.len() == first {
        return;
    }
    ends.resize(state.v.len(), 0.0);
    let mut at = 0;
    if let (true, Some(hand)) = (island.hand, model.hand()) {
        at = model.hand_dofs();
        dynamics.kin.velocities(hand, &v[..at], links);
    }
    for &k in &island.objects {
        ends[model.object_dofs(k)..][..6].copy_from_slice(&v[at..at + 6]);
        at += 6;
    }
    speeds.clear();
    speeds.resize(motion.speeds.len(), -1.0);
    let origin = dynamics.kin.origin;
    let mut ends = Ends { model, v: ends, links, origin, objects: &state.objects, poses, speeds };
    let is_hit = |k: &usize| ends.hit(left_out.list[*k], (left_out, distances), &mut outcome.work);
    hit.extend(island.left_out.iter().copied().chain(first..left_out.list.len()).filter(is_hit));
}

/// Lets an entry of the list join, with all that is left out of its pair; the index of its contact.
fn join(model: &Model, state: &mut State, work: &mut Work, k: usize) -> Option<usize> {
    let Work { collision, dynamics, .. } = work;
    let Collision { contacts, poses, bounds, motion, distances, .. } = collision;
    let left = contacts.left_out.list[k];
    if left.joined {
        return None;
    }
    let same = |other: &&mut LeftOut| other.index == left.index;
    contacts.left_out.list.iter_mut().filter(same).for_each(|other| other.joined = true);
    let State { v, objects, sleep, pairs, .. } = state;
    let bodies = Bodies { model, dynamics, v, objects, sleep };
    contacts.join(&bodies, &Shapes { poses, bounds, speeds: &motion.speeds }, distances, pairs, left.index)
}
