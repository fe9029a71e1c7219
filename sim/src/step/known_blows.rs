//! Blows whose impulses are known before the step is solved: those without friction.
//!
//! In the step's problem a rebounding contact is a stiff spring, `p = R (v̂ − v)`: with the velocity v⁺ after the blow as v̂ it would
//! miss p/R of it, and rounding grows with R. If p is known, v̂ is `v⁺ + p/R`, and the solve starts from the velocities after the blow.
//! Where nothing else acts it ends there at once: energy and momentum are kept, and mirror bodies keep mirror velocities.

use super::impacts::{Bodies, free_body, on_hand, on_object};
use crate::contact::narrow_phase::{ContactPair, ContactPoint, Contacts};
use crate::solver::island::Island;
use crate::solver::problem::Problem;
use palmares_models::Vec3;

/// Whether an island has surfaces whose blows are known.
fn any_known(contacts: &Contacts, island: &Island) -> bool {
    let mut pairs = island.pairs.iter().map(|&index| &contacts.pairs[index]);
    pairs.any(|pair| pair.restitution > 0.0 && pair.friction == 0.0)
}

/// Notes the impulse of an island's only rebound.
pub(super) fn note_single(bodies: Bodies<'_>, contacts: &mut Contacts, island: &Island) {
    if !any_known(contacts, island) {
        return;
    }
    let Contacts { pairs, points, .. } = contacts;
    let mut single = None;
    for &index in &island.pairs {
        let pair = &pairs[index];
        for k in pair.points.clone() {
            if !points[k].rebound.is_some_and(|rebound| rebound.time_s.is_finite()) {
                continue;
            }
            if single.is_some() || pair.restitution == 0.0 || pair.friction > 0.0 || on_hand(pair) {
                return;
            }
            single = Some((pair, k));
        }
    }
    if let Some((pair, k)) = single {
        let impulse = impulse(bodies, pair, &points[k]);
        if let Some(rebound) = &mut points[k].rebound {
            rebound.impulse = impulse;
        }
    }
}

/// Impulse after which a point has the velocity of its rebound, N s.
fn impulse(bodies: Bodies<'_>, pair: &ContactPair, point: &ContactPoint) -> f64 {
    let Bodies { model, state, .. } = bodies;
    let (normal, h) = (point.normal, model.config().step_s);
    let (mut free, mut yielding) = ((bodies.pull(pair.b) - bodies.pull(pair.a)).dot(normal) * h, 0.0);
    for (owner, sign) in [(pair.a, -1.0), (pair.b, 1.0)] {
        let Some(body) = on_object(owner).map(|k| free_body(model, state, k)) else { continue };
        let [linear, angular] = body.start;
        let arm = pair.origin + point.r - body.center;
        let moment = arm.cross(normal);
        free += (linear + angular.cross(arm)).dot(normal) * sign;
        yielding += body.inverse_mass + moment.dot(body.inverse_inertia * moment);
    }
    let after = point.rebound.map_or(free, |rebound| rebound.velocity);
    ((after - free) / yielding).max(0.0)
}

/// Changes the start `v` of the solve: bodies that known blows strike have the velocities after them.
pub(super) fn start(contacts: &Contacts, island: &Island, problem: &Problem, v: &mut [f64]) {
    if !any_known(contacts, island) {
        return;
    }
    for (slot, object) in problem.objects.iter().enumerate() {
        let mut blow: Option<[Vec3; 2]> = None;
        for &index in &island.pairs {
            let pair = &contacts.pairs[index];
            for (owner, sign) in [(pair.a, -1.0), (pair.b, 1.0)] {
                if on_object(owner) != Some(object.object) {
                    continue;
                }
                for point in &contacts.points[pair.points.clone()] {
                    let impulse = point.rebound.map_or(0.0, |rebound| rebound.impulse);
                    if impulse > 0.0 {
                        let impulse = point.normal * (sign * impulse);
                        let [linear, angular] = blow.get_or_insert_default();
                        *linear += impulse;
                        *angular += (pair.origin + point.r - object.center).cross(impulse);
                    }
                }
            }
        }
        let Some([linear, angular]) = blow else { continue };
        let before = &problem.momentum[problem.hand_dofs + 6 * slot..][..6];
        let [p, l] = [&before[..3], &before[3..]].map(Vec3::from_slice);
        let own = &mut v[problem.hand_dofs + 6 * slot..][..6];
        own[..3].copy_from_slice(&((p + linear) / object.mass).to_array());
        own[3..].copy_from_slice(&(object.inertia.inverse() * (l + angular)).to_array());
    }
}
