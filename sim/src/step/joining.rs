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
use crate::model::Model;
use crate::solver::island::{Island, Islands};
use crate::state::State;

/// Scratch memory of the comparison.
#[derive(Default)]
pub(crate) struct Joining {
    /// Generalized velocity at the end of the step.
    v: Vec<f64>,
    /// Velocities of the links with it.
    links: Vec<SpatialVelocity>,
    /// Entries of the list that are hit.
    hit: Vec<usize>,
}

/// Lets join what was left out between two islands, which may unite them, and gives each island the rest.
pub(super) fn between_islands(model: &Model, state: &mut State, work: &mut Work, islands: &mut Islands) {
    let left_out = std::mem::take(&mut work.collision.contacts.left_out);
    let hit = &mut work.joining.hit;
    hit.clear();
    hit.extend((0..left_out.len()).filter(|&k| islands.separates(left_out[k].a, left_out[k].b)));
    work.collision.contacts.left_out = left_out;
    let hit = std::mem::take(&mut work.joining.hit);
    for &k in &hit {
        join(model, state, work, k);
    }
    if !hit.is_empty() {
        islands.update(model, &work.collision.contacts);
    }
    work.joining.hit = hit;
    islands.distribute(&work.collision.contacts);
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
    let left_out = &work.collision.contacts.left_out;
    island.left_out.retain(|&k| !left_out[k].joined);
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
    let Joining { v: ends, links, hit } = joining;
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
    let Collision { contacts, poses, .. } = collision;
    let origin = dynamics.kin.origin;
    let ends = Ends { model, v: ends, links, origin, objects: &state.objects, poses };
    let is_hit = |k: &usize| ends.hit(&contacts.left_out[*k], &mut outcome.work);
    hit.extend(island.left_out.iter().copied().filter(is_hit));
}

/// Lets an entry of the list join, with all that is left out of its pair; the index of its contact.
fn join(model: &Model, state: &mut State, work: &mut Work, k: usize) -> Option<usize> {
    let Work { collision, dynamics, .. } = work;
    let Collision { contacts, poses, bounds, speeds, distances, .. } = collision;
    let left: LeftOut = contacts.left_out[k];
    if left.joined {
        return None;
    }
    // The entries of a pair follow one another.
    let same = |other: &&mut LeftOut| other.key == left.key;
    contacts.left_out.iter_mut().filter(same).for_each(|other| other.joined = true);
    let State { v, objects, sleep, pairs, .. } = state;
    let bodies = Bodies { model, dynamics, v, objects, sleep };
    contacts.join(&bodies, &Shapes { poses, bounds, speeds }, distances, pairs, &left)
}
