//! Contacts that a step reaches although its search has left them out ([`crate::contact::left_out`]).
//!
//! The search leaves out what only a long way within the step reaches. Between two islands nothing stays left out
//! ([`between_islands`]), since each is solved and moved on its own. Within an island the solution decides, before anything moves:
//! what it hits joins ([`reached`]), and the island is solved again.

use super::work::Work;
use crate::contact::collide::Collision;
use crate::contact::left_out::{Ends, LeftOut};
use crate::contact::narrow_phase::{Bodies, Shapes};
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Model, Owner};
use crate::solver::island::{Island, Islands};
use crate::state::State;

/// Scratch memory of the comparison.
#[derive(Default)]
pub(crate) struct Joining {
    /// Generalized velocity at the end of the step.
    v: Vec<f64>,
    /// Velocities of the links with it.
    links: Vec<SpatialVelocity>,
    /// Bounds of the speeds of the shapes with it.
    speeds: Vec<f64>,
    /// Entries of the list that are hit.
    hit: Vec<usize>,
}

/// Lets join what was left out between two islands, which may unite them, and gives each island the rest.
pub(super) fn between_islands(model: &Model, state: &mut State, work: &mut Work, islands: &mut Islands) {
    let Work { collision, joining, .. } = work;
    let list = &collision.contacts.left_out.list;
    let mut hit = std::mem::take(&mut joining.hit);
    hit.clear();
    if !list.is_empty() {
        let owners = |left: &LeftOut| owners(model, collision, left);
        hit.extend((0..list.len()).filter(|&k| islands.separates(owners(&list[k]))));
    }
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
    find_hit(model, state, work, island, v);
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

/// Whether an island reaches something with the velocities `v` at the end of the step.
pub(super) fn reaches(model: &Model, state: &State, work: &mut Work, island: &Island, v: &[f64]) -> bool {
    find_hit(model, state, work, island, v);
    !work.joining.hit.is_empty()
}

/// Lists what an island hits of what was left out of it.
fn find_hit(model: &Model, state: &State, work: &mut Work, island: &Island, v: &[f64]) {
    let Work { joining, collision, dynamics, outcome, .. } = work;
    let Joining { v: ends, links, speeds, hit } = joining;
    hit.clear();
    if island.left_out.is_empty() {
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
    let Collision { contacts, poses, distances, motion, .. } = collision;
    speeds.clear();
    speeds.resize(motion.speeds.len(), -1.0);
    let origin = dynamics.kin.origin;
    let mut ends = Ends { model, v: ends, links, origin, objects: &state.objects, poses, speeds };
    let left_out = &contacts.left_out;
    let is_hit = |k: &usize| ends.hit(left_out.list[*k], (left_out, distances), &mut outcome.work);
    hit.extend(island.left_out.iter().copied().filter(is_hit));
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
