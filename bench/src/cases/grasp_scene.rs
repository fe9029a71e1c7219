//! The scene of a grasp: the hand palm down before the object, on a pedestal.

use anyhow::{Context, Result};

use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3, rotation};
use palmares_sim::{Config, Model, Owner, State};
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Step in which the object is moved away from the palm until it is free, m.
const SEARCH_M: f64 = 5e-4;
/// Half the edge of the pedestal, m, and the gap between pedestal and object at the start, m.
const PEDESTAL_M: f64 = 0.02;
const ABOVE_M: f64 = 1e-5;

/// A grasp ready to begin.
pub struct GraspStart {
    /// Hand, pedestal and object.
    pub model: Model,
    /// At rest.
    pub state: State,
    /// The hand's base.
    pub start: Pose,
}

/// An object and its pose before a hand. The grip's frame has the palm's normal as x and the fingers along z.
#[derive(Clone, Debug)]
pub struct Lie {
    /// The grasped object.
    pub object: Arc<Object>,
    /// Turns the hand's frame into the grip's.
    pub hand_from_grip: Rotation,
    /// Rotation of the object in the grip's frame.
    pub grip_from_object: Rotation,
    /// Position of the object's frame along the fingers, m.
    pub along_m: f64,
    /// Position of the object's frame along the knuckles, m.
    pub across_m: f64,
    /// Gap between hand and object, m; half a millimetre more at most.
    pub gap_m: f64,
    /// Friction coefficient of the pedestal's surface.
    pub pedestal_friction: f64,
}

/// The hand palm down before an object on a pedestal; the origin of the world is the object's frame.
///
/// # Errors
/// A shape without volume.
pub fn before(hand: &Arc<Hand>, config: Config, lie: &Lie) -> Result<GraspStart> {
    scene(hand, config, lie, true)
}

/// The same without a pedestal: the object floats where a person holds it until the hand has closed. Without gravity it
/// stays there.
///
/// # Errors
/// A shape without volume.
pub fn floating(hand: &Arc<Hand>, config: Config, lie: &Lie) -> Result<GraspStart> {
    scene(hand, config, lie, false)
}

fn scene(hand: &Arc<Hand>, config: Config, lie: &Lie, on_pedestal: bool) -> Result<GraspStart> {
    let mut model = Model::new(config, Some(Arc::clone(hand)))?;
    let solid = |(pose, shape): &(Pose, Shape)| {
        let (parry, upright) = shape.to_parry().context("a part of the object has no volume")?;
        Ok((*pose * upright, parry))
    };
    let parts: Vec<(Pose, SharedShape)> = lie.object.parts.iter().map(solid).collect::<Result<_>>()?;
    let q = State::at_rest(&model, Pose::IDENTITY, &[]).q;
    let links = hand.base_from_links(&q);
    let hand_from_grip = Pose::from_parts(Vec3::ZERO, lie.hand_from_grip);
    let at = |x: f64| Vec3::new(x, lie.across_m, lie.along_m);
    let clearance = |x: f64| {
        let hand_from_object = hand_from_grip * Pose::from_parts(at(x), lie.grip_from_object);
        let mut least = f64::INFINITY;
        for collider in model.colliders() {
            let Owner::Link(i) = collider.owner else { continue };
            let pose = links[i] * collider.body_from_shape;
            for (part, shape) in &parts {
                let gap = query::distance(&pose, &*collider.shape, &(hand_from_object * *part), &**shape);
                least = least.min(gap.map_or(f64::INFINITY, |gap| gap.distance));
            }
        }
        least
    };
    let mut x = 0.0;
    loop {
        let missing = lie.gap_m - clearance(x);
        if missing <= 0.0 {
            break;
        }
        // No surface comes nearer by more than the object moves: steps that cannot be enough are skipped.
        for _ in 0..(missing / SEARCH_M).ceil() as usize {
            x += SEARCH_M;
        }
    }
    // The palm's normal points down.
    let world_from_grip = rotation::from_rpy([0.0, FRAC_PI_2, 0.0]);
    let world_from_hand: Rotation = world_from_grip * lie.hand_from_grip.inverse();
    let start = Pose::from_parts(-(world_from_grip * at(x)), world_from_hand);
    let object = Pose::from_parts(Vec3::ZERO, world_from_grip * lie.grip_from_object);
    if on_pedestal {
        let low = parts.iter().map(|(part, shape)| shape.compute_aabb(&(object * *part)).mins.z);
        let low = low.fold(f64::INFINITY, f64::min);
        let cube = Shape::Box { half_extents: [PEDESTAL_M; 3], rounding: 0.0 };
        let under = Pose::translation(0.0, 0.0, low - PEDESTAL_M - ABOVE_M);
        model.add_static("pedestal", &cube, under, lie.pedestal_friction)?;
    }
    model.add_object(Arc::clone(&lie.object))?;
    let state = State::at_rest(&model, start, &[object]);
    Ok(GraspStart { model, state, start })
}
