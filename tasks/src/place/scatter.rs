//! Putting objects down side by side.

use super::placed::Placed;
use super::rng::SceneRng;
use crate::task::{Scatter, Task};
use palmares_models::object::Object;
use palmares_models::{Pose, Rotation, Vec3, rotation};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;
use std::f64::consts::TAU;

/// Places tried for an object before all are lifted off again.
const TRIES: usize = 300;
/// Attempts to place all objects before other objects are drawn.
const ROUNDS: usize = 30;
/// Height above the floor at which an object is released, m.
const DROP_M: f64 = 2e-4;

/// The convex parts of an object at its pose.
struct Standing {
    parts: Vec<(Pose, SharedShape, Aabb)>,
}

impl Standing {
    fn new(object: &Object, pose: Pose) -> Self {
        let parts = object.parts.iter().filter_map(|(body_from_part, shape)| {
            let (parry, upright) = shape.to_parry()?;
            let at = pose * *body_from_part * upright;
            let around = parry.compute_aabb(&at);
            Some((at, parry, around))
        });
        Standing { parts: parts.collect() }
    }

    fn within(&self, low: Vec3, high: Vec3, gap: f64) -> bool {
        self.parts.iter().all(|(_, _, around)| {
            around.mins.x >= low.x + gap
                && around.maxs.x <= high.x - gap
                && around.mins.y >= low.y + gap
                && around.maxs.y <= high.y - gap
                && around.maxs.z <= high.z
        })
    }

    fn nearer_than(&self, other: &Standing, gap: f64) -> bool {
        self.parts.iter().any(|(at, shape, around)| {
            let grown = Aabb::new(around.mins - Vec3::splat(gap), around.maxs + Vec3::splat(gap));
            other.parts.iter().any(|(at_other, shape_other, around_other)| {
                let bounds_clear = (0..3)
                    .any(|k| grown.mins[k] > around_other.maxs[k] || grown.maxs[k] < around_other.mins[k]);
                // Shapes for which parry knows no distance count as touching.
                !bounds_clear
                    && query::distance(at, &**shape, at_other, &**shape_other)
                        .map_or(true, |d| d.distance < gap)
            })
        })
    }
}

/// Poses without overlap within the region; an error if there is no space.
pub(super) fn scatter(
    task: &Task,
    scatter: &Scatter,
    objects: &[Placed],
    dice: &mut SceneRng,
) -> Result<Vec<Pose>, String> {
    let Some((low, high)) = task.region(&scatter.into) else {
        return Err(format!("there is no region `{}`", scatter.into));
    };
    let (low, high) = (Vec3::from_array(low), Vec3::from_array(high));
    // The largest first: the small ones find room in between.
    let mut order: Vec<(usize, Vec3, Vec3)> = objects
        .iter()
        .enumerate()
        .map(|(k, placed)| {
            let (min, max) = placed.object.bounds();
            (k, min, max)
        })
        .collect();
    let footprint = |(_, min, max): &(usize, Vec3, Vec3)| (max.x - min.x) * (max.y - min.y);
    order.sort_by(|a, b| footprint(b).total_cmp(&footprint(a)).then(a.0.cmp(&b.0)));
    for _ in 0..ROUNDS {
        if let Some(poses) = round(scatter.gap, objects, &order, low, high, dice) {
            return Ok(poses);
        }
    }
    Err(format!("{} objects found no room side by side in `{}`", objects.len(), scatter.into))
}

fn round(
    gap: f64,
    objects: &[Placed],
    order: &[(usize, Vec3, Vec3)],
    low: Vec3,
    high: Vec3,
    dice: &mut SceneRng,
) -> Option<Vec<Pose>> {
    let mut poses = vec![Pose::IDENTITY; objects.len()];
    let mut standing: Vec<Standing> = Vec::new();
    for &(k, min, _) in order {
        let tilt = objects[k].pose.rotation;
        let lowest = if tilt == Rotation::IDENTITY { min.z } else { lowest(&objects[k].object, tilt) };
        let found = (0..TRIES).find_map(|_| {
            let (x, y, yaw) = (dice.unit(), dice.unit(), TAU * dice.unit());
            let at = Vec3::new(
                low.x + x * (high.x - low.x),
                low.y + y * (high.y - low.y),
                low.z - lowest + DROP_M,
            );
            let pose = Pose::from_parts(at, rotation::from_rpy([0.0, 0.0, yaw]) * tilt);
            let here = Standing::new(&objects[k].object, pose);
            let free = here.within(low, high, gap) && !standing.iter().any(|s| s.nearer_than(&here, gap));
            free.then_some((pose, here))
        });
        let (pose, here) = found?;
        poses[k] = pose;
        standing.push(here);
    }
    Some(poses)
}

/// The lowest point of an object that is turned so, above its origin, m.
fn lowest(object: &Object, turn: Rotation) -> f64 {
    let standing = Standing::new(object, Pose::from_parts(Vec3::ZERO, turn));
    standing.parts.iter().map(|(_, _, around)| around.mins.z).fold(f64::INFINITY, f64::min)
}
