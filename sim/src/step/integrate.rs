//! Positions at the end of a step, from the velocities there: `x₁ = x₀ + h v₁`.
//!
//! An object that rebounds at time t within the step flies ballistically before and after it; an object that
//! contacts leave free moves with the mean velocity ([`super::midpoint_correction`]).

use super::impacts::{Impacts, ObjectImpact, Touch, on_object, pull};
use super::midpoint_correction::{Correction, correction};
use super::torque_free::{omega_at, turned, unlike};
use crate::contact::narrow_phase::Contacts;
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::problem::Problem;
use crate::state::State;
use palmares_models::{Pose, Rotation, Vec3};

/// Contacts turn a body away from its torque-free orientation. Under steady forces its angular momentum stays that of the
/// solution, and the angular velocity follows from the new orientation. In a rebound, in a blow that would gain so, and beyond this
/// limit, the body keeps the angular velocity in its own axes, and with it the energy: part of a needle's turn about its middle would
/// become spin about its axis, at a thousand times the speed. The limit, rad, is on the turn times the ratio of the body's moments
/// of inertia, 1.1 for a thin disc, 550 for a needle.
const FAR_TURN: f64 = 0.25;

/// A body that turns by less than this in a step, rad, keeps its angular velocity in a blow: a slab that falls on a corner then turns
/// most alike at every step.
const SMALL_TURN: f64 = 0.1;

/// Contacts that press with more than so many times an object's weight strike it, unless a hand grips it.
const BLOW: f64 = 5.0;

/// Moves joint coordinates by `v · time`; returns the new pose of the base.
fn advanced(base: Pose, q: &mut [f64], v: &[f64], time: f64) -> Pose {
    for (q, rate) in q.iter_mut().zip(&v[6..]) {
        *q += time * rate;
    }
    let [linear, angular] = [&v[..3], &v[3..6]].map(Vec3::from_slice);
    Pose::from_parts(base.translation + linear * time, turned(base.rotation, angular * time))
}

/// Moves the hand with velocity `v` for a time, s. A bolted base moves to its set point.
pub(super) fn move_hand(model: &Model, state: &mut State, bolted: bool, v: &[f64], time_s: f64) {
    let n = model.hand_dofs();
    state.v[..n].copy_from_slice(&v[..n]);
    state.base = advanced(state.base, &mut state.q, &v[..n], time_s);
    if bolted {
        state.base = state.reference.pose;
    }
}

/// Notes how contacts act on the objects of an island.
fn mark_touched(contacts: &Contacts, island: &Island, problem: &Problem, touched: &mut Vec<Touch>) {
    touched.clear();
    touched.resize(island.objects.len(), Touch::default());
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let (mut acts, mut impulse) = (false, 0.0);
        for point in &problem.points[solved.first..solved.end] {
            acts |= point.impulse[2] > 0.0;
            impulse += point.impulse[2];
        }
        let rebounds = acts && contacts.pairs[index].restitution > 0.0;
        let mut touch = |owner: Owner| {
            let Some(k) = on_object(owner) else { return };
            let of = &mut touched[island.objects.binary_search(&k).unwrap_or(0)];
            of.acts |= acts;
            of.rebounds |= rebounds;
            of.impulse += impulse;
        };
        touch(solved.a);
        touch(solved.b);
    }
}

/// Moves the objects of an island, whose part of `v` begins at `at`; consumes their `impacts`. True if one moves in second order.
pub(super) fn move_objects(
    model: &Model,
    state: &mut State,
    island: &Island,
    problem: &Problem,
    v: &[f64],
    (contacts, loads): (&Contacts, &[(Vec3, Vec3)]),
    Impacts { of_objects: impacts, touched, .. }: &mut Impacts,
) -> bool {
    if island.objects.is_empty() {
        return false;
    }
    let mut in_second_order = false;
    let h = model.config().step_s;
    let mut at = problem.hand_dofs;
    let alone = island.is_lone_object();
    mark_touched(contacts, island, problem, touched);
    for (slot, (&k, solved)) in island.objects.iter().zip(&problem.objects).enumerate() {
        let to = model.object_dofs(k);
        let own = &v[at..at + 6];
        let [after, angular] = [&own[..3], &own[3..]].map(Vec3::from_slice);
        let before = Vec3::from_slice(&state.v[to..to + 3]);
        let carried = match solved.turn {
            None => Vec3::from_slice(&state.v[to + 3..to + 6]),
            Some((_, omega)) => omega,
        };
        let pose = &mut state.objects[k];
        let mut more = Correction::default();
        match impacts[k].take() {
            None if !alone && touched[slot].acts => pose.translation += after * h,
            // As in free flight.
            None if !alone => pose.translation += (before + after) * (0.5 * h),
            None => {
                let short = ((before - after) * (0.5 * h), (carried - angular) * (0.5 * h));
                if model.has(Law::ObjectOrder) {
                    more = correction(problem, slot, angular * h, short.0, short.1);
                }
                // No object may move farther than the faster of its velocities allows: cached gaps rely on
                // that.
                let farthest = before.length_squared().max(after.length_squared()) * h * h;
                if (after * h + more.linear).length_squared() > farthest {
                    more = Correction::default();
                }
                in_second_order |= more.linear != Vec3::ZERO || more.angular != Vec3::ZERO;
                pose.translation += after * h + more.linear;
            }
            Some(ObjectImpact { stays: true, .. }) => pose.translation += after * h,
            Some(ObjectImpact { time_s: t, detour, .. }) => {
                let rest = h - t;
                let pull = pull(model, loads, k);
                pose.translation += before * t + after * rest + pull * (0.5 * (t * t - rest * rest)) + detour;
            }
        }
        state.v[to..to + 6].copy_from_slice(own);
        // Torque turns the body from its torque-free orientation: its angular momentum is kept to rounding.
        let (start, by) = match solved.turn {
            None => (pose.rotation, angular * h + more.angular),
            Some((rotation, omega)) => (rotation, (angular - omega) * h + more.angular),
        };
        pose.rotation = turned(start, by);
        // A ball keeps its angular velocity however it turns.
        if solved.turn.is_some() && by != Vec3::ZERO {
            let (inertia, inverse) = (model.objects()[k].inertia, model.object_inertia_inverse(k));
            let weight = solved.mass * model.config().gravity.length();
            let momentum = solved.inertia * angular;
            let kept = omega_at(pose.rotation, inverse, momentum);
            let struck = !island.hand && touched[slot].impulse > BLOW * weight * h;
            let far = by.length() * unlike(inertia, inverse) > FAR_TURN;
            let with_it = if struck && !far && !touched[slot].rebounds && angular.length() * h <= SMALL_TURN {
                angular
            } else if touched[slot].rebounds || far || struck && kept.dot(momentum) > angular.dot(momentum) {
                turned(Rotation::IDENTITY, by) * angular
            } else {
                kept
            };
            state.v[to + 3..to + 6].copy_from_slice(&with_it.to_array());
        }
        at += 6;
    }
    in_second_order
}
