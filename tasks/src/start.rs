//! The start of a hand: its way into a scene that does not depend on it, and the bodies that it must not touch.
//!
//! A scene settles without a hand, or a hand could choose its scene by what it touches. The hand settles alone, in
//! the air, and is then added to the objects, which stay as they are, bit for bit.

use crate::overlap::{Obstacle, Overlap};
use crate::place::placing_room;
use crate::scene::Scene;
use crate::settle::{Built, SCENE_WORK, SceneError, furnished};
use crate::task::{Task, Variation};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, Config, Model, Owner, State, World};
use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;
use std::sync::Arc;

/// Maximum time until a hand rests on its base before the run begins, s.
const REST_S: f64 = 0.5;

/// Length along the fingers up to which a hand begins at the task's pose, m: the ReFlex and the SoftHand reach 0.28 m from
/// their bases.
const USUAL_LENGTH_M: f64 = 0.3;
/// Farthest that a hand begins behind the task's pose, m: then the longest hand of the default limits (0.6 m) is no nearer to
/// the objects than others.
const MAX_BACK_M: f64 = 0.3;

/// Initial pose of a hand's base: the task's, and farther back along the fingers by as much as the hand is longer than
/// usual, so that a long hand begins as far from the objects as others.
pub fn hand_start(task: &Task, hand: &Hand) -> Pose {
    let at = start_pose(task);
    let length = hand.bounding_box(&hand.beginning()).map_or(0.0, |(_, high)| high.z);
    if length <= USUAL_LENGTH_M {
        return at;
    }
    let back = at.rotation * Vec3::Z * (length - USUAL_LENGTH_M).min(MAX_BACK_M);
    Pose::from_parts(at.translation - back, at.rotation)
}

/// Initial pose of the base of a hand of usual length.
pub fn start_pose(task: &Task) -> Pose {
    task.hand.pose()
}

/// Furniture and regions of the rules that a hand overlaps at its start, with every seed; empty if it fits. Objects depend on
/// the seed: [`crate::build::build`] also checks these, and [`may_overlap`] the volume in which any seed may put them.
///
/// # Errors
/// The hand cannot be simulated, or finds no rest that is finite.
pub fn overlaps(task: &Task, hand: Arc<Hand>) -> Result<Vec<Overlap>, SceneError> {
    let (world, names) = joined(task, &furnished(task)?, hand)?;
    Ok(overlapping(task, &world, &names, None))
}

/// The result of [`overlaps`], and the links that reach into the volume of initial objects. Empty if the hand fits with every
/// seed.
///
/// # Errors
/// The same as of [`overlaps`].
pub fn may_overlap(task: &Task, hand: Arc<Hand>) -> Result<Vec<Overlap>, SceneError> {
    let (world, names) = joined(task, &furnished(task)?, hand)?;
    let room = placing_room(task);
    let name = task.place.into_region().unwrap_or("place.fixed");
    let room = room.map(|(min, max)| cuboid(name, Obstacle::Placing, min, max));
    Ok(overlapping(task, &world, &names, room))
}

/// A part of space that is looked at as if it were a solid box.
fn cuboid(name: &str, obstacle: Obstacle, min: [f64; 3], max: [f64; 3]) -> Standing<'_> {
    let (min, max) = (Vec3::from_array(min), Vec3::from_array(max));
    let half = (max - min) * 0.5;
    let shape = SharedShape::cuboid(half.x, half.y, half.z);
    Standing { name, obstacle, at: Pose::from_translation(min + half), shape }
}

/// Puts a hand into a scene that was built without.
pub(crate) fn put_in(task: &Task, scene: Built, hand: Arc<Hand>) -> Result<Built, SceneError> {
    let (world, body_names) = joined(task, &scene, hand)?;
    let overlaps = overlapping(task, &world, &body_names, None);
    if overlaps.is_empty() {
        let gravity = world.model().config().gravity.to_array();
        Ok(Built { world, scene: Scene { gravity, ..scene.scene }, body_names })
    } else {
        Err(SceneError::HandInTheWay { task: task.name.clone(), overlaps })
    }
}

/// The world of a scene with a hand at rest in it, and the names of its colliders' bodies.
fn joined(task: &Task, scene: &Built, hand: Arc<Hand>) -> Result<(World, Vec<String>), SceneError> {
    let unsound = |why: &dyn ToString| SceneError::unsound(task, why.to_string());
    let gravity = task.variation().and_then(Variation::gravity);
    let mut config = Config::with_step(task.step_s);
    config.gravity = gravity.unwrap_or(config.gravity);
    let alone = Model::new(config.clone(), Some(Arc::clone(&hand)));
    let alone = Arc::new(alone.map_err(|e| unsound(&e))?);
    let base = hand_start(task, &hand);
    let mut waiting = World::new(Arc::clone(&alone), State::at_rest(&alone, base, &[]));
    let wait = Command::stay(&alone, base);
    let mut work = 0;
    for _ in 0..(REST_S / task.step_s) as u64 {
        if waiting.fault().is_some() || work > SCENE_WORK {
            break;
        }
        work += waiting.step(&wait).work;
    }
    if let Some(fault) = waiting.fault() {
        return Err(unsound(&format!("hand `{}` finds no rest where it starts: {fault}", hand.name)));
    }
    if work > SCENE_WORK {
        let message = "needs more computing to come to rest where it starts than it may";
        return Err(unsound(&format!("hand `{}` {message}", hand.name)));
    }
    let model = scene.world.model().with_hand(Arc::clone(&hand)).map_err(|e| unsound(&e))?;
    let model = Arc::new(model.with_gravity(config.gravity));
    let links = alone.colliders().iter().map(|collider| match collider.owner {
        Owner::Link(i) => hand.links[i].name.clone(),
        Owner::Static | Owner::Object(_) => String::new(),
    });
    let names = links.chain(scene.body_names.iter().cloned()).collect();
    let mut world = World::joined(model, &waiting, &scene.world);
    if gravity.is_some() {
        // Objects fell asleep under the task's own.
        world.wake();
    }
    Ok((world, names))
}

/// A shape at its pose.
struct Standing<'a> {
    name: &'a str,
    obstacle: Obstacle,
    at: Pose,
    shape: SharedShape,
}

/// The overlaps of the hand, each pair once, in the order of the model, then regions and `room`.
fn overlapping(task: &Task, world: &World, names: &[String], room: Option<Standing<'_>>) -> Vec<Overlap> {
    let (model, state) = (world.model(), world.state());
    let Some(hand) = model.hand() else { return Vec::new() };
    let base_from_links = hand.base_from_links(&state.q);
    let mut parts = Vec::new();
    let mut things = Vec::new();
    for (collider, name) in model.colliders().iter().zip(names) {
        let thing =
            |at, obstacle| Standing { name: name.as_str(), obstacle, at, shape: collider.shape.clone() };
        match collider.owner {
            Owner::Link(i) => {
                let at = state.base * base_from_links[i] * collider.body_from_shape;
                parts.push((name, at, collider.shape.clone()));
            }
            Owner::Object(k) => {
                things.push(thing(state.objects[k] * collider.body_from_shape, Obstacle::Object));
            }
            Owner::Static => things.push(thing(collider.body_from_shape, Obstacle::Furniture)),
        }
    }
    let regions = task.regions().filter(|(name, _)| task.rules.role(name).is_some());
    things.extend(regions.map(|(name, (min, max))| cuboid(name, Obstacle::Region, min, max)));
    things.extend(room);
    let mut found: Vec<Overlap> = Vec::new();
    for (link, at, shape) in parts {
        let around = shape.compute_aabb(&at);
        for thing in &things {
            let near = thing.shape.compute_aabb(&thing.at).intersects(&around);
            let known = |o: &Overlap| o.link == *link && o.obstacle == thing.obstacle && o.name == thing.name;
            if !near || found.iter().any(known) {
                continue;
            }
            // Shapes for which parry knows no distance count as touching.
            let distance = query::distance(&at, &*shape, &thing.at, &*thing.shape);
            if distance.map_or(true, |d| d.distance <= 0.0) {
                found.push(Overlap {
                    link: link.clone(),
                    obstacle: thing.obstacle,
                    name: thing.name.to_owned(),
                });
            }
        }
    }
    found
}
