//! Collision detection of one step: bounds, near pairs, contact points. Touched bodies wake.

use super::broad_phase::{BroadPhase, tight_bounds};
use super::distance_cache::DistanceCache;
use super::narrow_phase::{Bodies, Contacts, Shapes};
use crate::bounds::step_work;
use crate::dynamics::hand::HandDynamics;
use crate::model::{Model, Owner};
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
    /// Upper bound of the speed of any point of each shape at the start of the step, m/s.
    pub speeds: Vec<f64>,
    /// The same speeds one step earlier; empty after a change of the state from outside.
    speeds_before: Vec<f64>,
    /// Largest distance that any point of each shape can have moved in the last step, m.
    paths: Vec<f64>,
    /// Objects that slept at the last update.
    asleep: Vec<bool>,
}

impl Collision {
    /// Discards cached results: the state has been changed from outside.
    pub(crate) fn invalidate(&mut self) {
        self.broad_phase.invalidate();
        self.bounds.clear();
        self.speeds.clear();
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
    update_shapes(model, state, dynamics, collision);
    let Collision { contacts, poses, distances, broad_phase, bounds, speeds, speeds_before, paths, asleep } =
        collision;
    if broad_phase.update(model, bounds) {
        distances.follow(broad_phase.keys());
        // The memory of all other pairs is dropped.
        state.pairs.retain(|pair| broad_phase.keys().binary_search(&pair.key).is_ok());
        spent += (model.colliders().len() * model.colliders().len()) as u64;
    }
    let known = speeds_before.len() == speeds.len();
    update_paths(model, speeds, speeds_before, paths);
    if !known {
        distances.clear(speeds.len());
    }
    let h = model.config().step_s;
    let from_rest = model.config().from_rest(false);
    let ahead = speeds.iter().map(|speed| 2.0 * h * speed + 0.5 * from_rest);
    distances.travel(if known { paths } else { &[] }, ahead);
    let allowed = step_work(model.objects().len());
    // Every round but the last wakes at least one object.
    loop {
        let bodies = Bodies { model, dynamics, v: &state.v, objects: &state.objects, sleep: &state.sleep };
        if asleep.iter().zip(&state.sleep).any(|(slept, sleep)| *slept && !sleep.asleep) {
            distances.reactivate(|shape| bodies.is_awake(model.colliders()[shape].owner));
        }
        asleep.clear();
        asleep.extend(state.sleep.iter().map(|sleep| sleep.asleep));
        let shapes = Shapes { poses, bounds, speeds };
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

/// Pose, bounds and speed of every shape.
fn update_shapes(model: &Model, state: &State, dynamics: &HandDynamics, collision: &mut Collision) {
    let (h, margin) = (model.config().step_s, 0.5 * model.config().margin(false));
    let Collision { poses, bounds, speeds, speeds_before, asleep, .. } = collision;
    let fresh = bounds.len() != model.colliders().len();
    if fresh {
        poses.resize(model.colliders().len(), Pose::IDENTITY);
        bounds.resize(model.colliders().len(), Aabb::new_invalid());
    }
    let bodies = Bodies { model, dynamics, v: &state.v, objects: &state.objects, sleep: &state.sleep };
    std::mem::swap(speeds, speeds_before);
    speeds.clear();
    for (i, collider) in model.colliders().iter().enumerate() {
        let pose = match collider.owner {
            // Furniture has not moved.
            Owner::Static if !fresh => {
                speeds.push(0.0);
                continue;
            }
            // Neither has an object that slept through the last step.
            Owner::Object(k) if !fresh && state.sleep[k].asleep && asleep.get(k) == Some(&true) => {
                speeds.push(0.0);
                continue;
            }
            Owner::Static => collider.body_from_shape,
            Owner::Link(i) => dynamics.kin.pose[i] * collider.body_from_shape,
            Owner::Object(k) => state.objects[k] * collider.body_from_shape,
        };
        let speed = if collider.owner == Owner::Static {
            0.0
        } else {
            let motion = bodies.velocity(collider.owner, pose.translation);
            motion.linear.length() + motion.angular.length() * collider.bounding_radius
        };
        bounds[i] = tight_bounds(&collider.local_bounds, &pose, margin + h * speed);
        poses[i] = pose;
        speeds.push(speed);
    }
}

/// Largest motion of each shape in the last step. No point moved faster than the faster of its two speeds,
/// apart from gravity on a ballistic path and rounding.
fn update_paths(model: &Model, speeds: &[f64], before: &[f64], paths: &mut Vec<f64>) {
    let h = model.config().step_s;
    let fall = model.config().gravity.length() * h * h;
    paths.resize(speeds.len(), f64::INFINITY);
    if before.len() != speeds.len() {
        paths.fill(f64::INFINITY);
        return;
    }
    let faster = speeds.iter().zip(before).map(|(a, b)| a.max(*b));
    for ((path, speed), collider) in paths.iter_mut().zip(faster).zip(model.colliders()) {
        let own = if speed > 0.0 { 1.01 * h * speed + fall } else { 0.0 };
        // The step of a hand starts with a third of its last displacement (BDF2).
        let linked = matches!(collider.owner, Owner::Link(_)) && path.is_finite();
        *path = if linked { own.max((*path + 2.0 * own) / 3.0) } else { own };
    }
}
