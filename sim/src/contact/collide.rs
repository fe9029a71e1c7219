//! Collision detection of one step: bounds, near pairs, contact points. Touched bodies wake.

use super::bodies::Bodies;
use super::broad_phase::{BroadPhase, tight_bounds};
use super::distance_cache::DistanceCache;
use super::left_out::leaves_out;
use super::motion::{self, Motion};
use super::narrow_phase::{Contacts, Shapes};
use super::reach::SHORT_M;
use crate::bounds::step_work;
use crate::dynamics::hand::HandDynamics;
use crate::model::{Collider, Model, Owner};
use crate::state::State;
use palmares_models::Pose;
use parry3d_f64::bounding_volume::Aabb;

/// The contacts of a step, and the scratch memory of their search.
#[derive(Default)]
pub(crate) struct Collision {
    pub contacts: Contacts,
    /// World pose of every shape.
    pub poses: Vec<Pose>,
    pub distances: DistanceCache,
    broad_phase: BroadPhase,
    /// Bounds of every shape, grown by half the margin and by its motion in a step.
    pub bounds: Vec<Aabb>,
    pub motion: Motion,
    /// Objects that slept at the last update.
    asleep: Vec<bool>,
}

impl Collision {
    /// Discards cached results: the state has been changed from outside.
    pub(crate) fn invalidate(&mut self) {
        self.broad_phase.invalidate();
        self.bounds.clear();
        self.asleep.clear();
    }
}

/// Finds the contact points of a step in `state`, whose hand has these `dynamics`. Touched bodies wake, and
/// so do the bodies that they touch. `spent` is the computing of the step up to here; returns the computing
/// after the search. The search ends beyond [`step_work`].
pub(crate) fn collide(
    model: &Model,
    state: &mut State,
    dynamics: &HandDynamics,
    collision: &mut Collision,
    mut spent: u64,
) -> u64 {
    if model.colliders().is_empty() {
        return spent;
    }
    let fresh = collision.bounds.len() != model.colliders().len();
    update_shapes(model, state, dynamics, collision, fresh);
    let Collision { contacts, poses, distances, broad_phase, bounds, motion, asleep } = collision;
    if broad_phase.update(model, bounds) {
        distances.follow(broad_phase.keys(), |key| (slot_shift(model, key), waits(model, key)));
        // The memory of all other pairs is dropped.
        state.pairs.retain(|pair| broad_phase.keys().binary_search(&pair.key).is_ok());
        spent += (model.colliders().len() * model.colliders().len()) as u64;
    }
    if fresh {
        distances.clear(motion.speeds.len());
    }
    let h = model.config().step_s;
    let from_rest = model.config().from_rest(false);
    let reach = |speed: f64| 2.0 * h * speed + 0.5 * from_rest;
    let short = leaves_out(model).then_some(|speed: f64| h * speed + 0.5 * SHORT_M);
    distances.travel(&motion.ways, &motion.speeds, reach, short);
    let allowed = step_work(model.objects().len());
    // Every round but the last wakes at least one object.
    loop {
        let bodies = Bodies { model, dynamics, v: &state.v, objects: &state.objects, sleep: &state.sleep };
        if asleep.iter().zip(&state.sleep).any(|(slept, sleep)| *slept && !sleep.asleep) {
            distances.reactivate(|shape| bodies.is_awake(model.colliders()[shape].owner));
        }
        asleep.clear();
        asleep.extend(state.sleep.iter().map(|sleep| sleep.asleep));
        let shapes = Shapes { poses, bounds, speeds: &motion.speeds };
        spent += contacts.find(&bodies, &shapes, distances, &mut state.pairs, allowed.saturating_sub(spent));
        let mut woken = false;
        for pair in &contacts.pairs {
            for owner in [pair.a, pair.b] {
                if let Owner::Object(k) = owner {
                    woken |= state.sleep[k].asleep;
                    state.sleep[k].asleep = false;
                }
            }
        }
        if !woken || spent > allowed {
            return spent;
        }
    }
}

/// Shift of the odometers of a pair: one of the hand counts in the frame of its base, behind all odometers in the world.
fn slot_shift(model: &Model, (a, b): (u32, u32)) -> u32 {
    let [a, b] = [a, b].map(|k| model.colliders()[k as usize].owner);
    let of_hand = matches!(a, Owner::Link(_)) || matches!(b, Owner::Link(_));
    if of_hand && a != Owner::Static && b != Owner::Static { model.colliders().len() as u32 } else { 0 }
}

/// Whether a pair of the hand waits for the solution of a step: none of its bodies sleeps, is an object of its own, or rebounds.
fn waits(model: &Model, (a, b): (u32, u32)) -> bool {
    let [a, b] = [a, b].map(|k| &model.colliders()[k as usize]);
    let is_object = |shape: &Collider| matches!(shape.owner, Owner::Object(_));
    leaves_out(model) && !is_object(a) && !is_object(b) && a.restitution.max(b.restitution) == 0.0
}

/// Pose, bounds and motion of every shape; `fresh` if nothing is known of them.
fn update_shapes(
    model: &Model,
    state: &State,
    dynamics: &HandDynamics,
    collision: &mut Collision,
    fresh: bool,
) {
    let (h, margin) = (model.config().step_s, 0.5 * model.config().margin(false));
    let Collision { poses, bounds, motion, asleep, .. } = collision;
    if fresh {
        poses.resize(model.colliders().len(), Pose::IDENTITY);
        bounds.resize(model.colliders().len(), Aabb::new_invalid());
    }
    let bodies = Bodies { model, dynamics, v: &state.v, objects: &state.objects, sleep: &state.sleep };
    motion.begin(&bodies, fresh);
    let Motion { now, far, seen, frame, .. } = motion;
    let moved = now.iter_mut().zip(far).zip(seen);
    let shapes = model.colliders().iter().zip(poses).zip(bounds).zip(moved);
    for (((collider, at), bounds), ((speed, far), seen)) in shapes {
        let pose = match collider.owner {
            // Furniture has not moved.
            Owner::Static if !fresh => continue,
            // Neither has an object that slept through the last step.
            Owner::Object(k) if !fresh && state.sleep[k].asleep && asleep.get(k) == Some(&true) => {
                *speed = 0.0;
                if frame.by_base {
                    *far = frame.far(collider, at);
                    *seen = frame.rests(collider, at, *far);
                }
                continue;
            }
            Owner::Static => collider.body_from_shape,
            Owner::Link(i) => dynamics.kin.pose[i] * collider.body_from_shape,
            Owner::Object(k) => state.objects[k] * collider.body_from_shape,
        };
        if collider.owner != Owner::Static {
            let velocity = bodies.velocity(collider.owner, pose.translation);
            *speed = motion::speed(velocity, collider);
            if frame.by_base {
                *far = frame.far(collider, &pose);
                *seen = frame.moves(&bodies, collider, velocity, at, &pose);
            }
        }
        *bounds = tight_bounds(&collider.local_bounds, &pose, margin + h * *speed);
        *at = pose;
    }
    motion.end(&bodies);
}
