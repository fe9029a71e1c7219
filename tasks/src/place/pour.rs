//! Pouring objects with rapier until they lie still.
//!
//! A pile of free objects needs no hand and no tendon: an ordinary rigid-body engine settles it. The result is
//! handed over at rest.

use super::placed::Placed;
use super::rng::SceneRng;
use crate::task::{Pour, Task};
use palmares_models::shape::{Shape, inertia};
use palmares_models::{Pose, Vec3};
use parry3d_f64::shape::SharedShape;
use rapier3d_f64::dynamics::CoefficientCombineRule;
use rapier3d_f64::dynamics::{FrictionModel, RigidBodyBuilder};
use rapier3d_f64::geometry::ColliderBuilder;
use rapier3d_f64::pipeline::PhysicsWorld;

/// Longest pouring, s.
const MAX_TIME_S: f64 = 10.0;
const STEP_S: f64 = 1.0 / 240.0;
/// Slower than this is still, m/s.
const STILL: f64 = 5e-3;

/// Drop positions: layers of a jittered grid over part of the region, m.
pub fn drop_points(task: &Task, pour: &Pour, dice: &mut SceneRng) -> Vec<Vec3> {
    let Some((low, high)) = task.region(&pour.into) else { return Vec::new() };
    let (low, high) = (Vec3::from_array(low), Vec3::from_array(high));
    let (center, size) = ((low + high) * 0.5, high - low);
    let count = task.objects.count;
    let per_layer = count.min(pour.layer);
    let columns = (1..).find(|w| w * w >= per_layer).unwrap_or(1);
    let rows = per_layer.div_ceil(columns);
    let place = |i: usize, n: usize, width: f64| {
        if n < 2 { 0.0 } else { (i as f64 - 0.5 * (n - 1) as f64) * width * pour.spread / (n - 1) as f64 }
    };
    (0..count)
        .map(|k| {
            let (layer, i) = (k / pour.layer, k % pour.layer);
            Vec3::new(
                center.x + place(i % columns, columns, size.x) + pour.jitter * dice.both_ways(),
                center.y + place(i / columns, rows, size.y) + pour.jitter * dice.both_ways(),
                low.z + pour.first_height + pour.layer_height * layer as f64,
            )
        })
        .collect()
}

/// Poses of the objects after pouring.
pub(super) fn pour(task: &Task, pour: &Pour, objects: &[Placed], dice: &mut SceneRng) -> Vec<Pose> {
    let mut world = PhysicsWorld::new();
    world.gravity = Vec3::new(0.0, 0.0, -9.81);
    let parameters = &mut world.integration_parameters;
    parameters.dt = STEP_S;
    parameters.length_unit = 0.1;
    parameters.friction_model = FrictionModel::Coulomb;
    parameters.contact_recycling = false;
    let ground =
        ColliderBuilder::new(SharedShape::halfspace(Vec3::Z)).translation(Vec3::Z * task.ground.height);
    world.insert_collider(surface(ground, task.ground.friction), None);
    let slabs = task
        .furniture
        .iter()
        .flat_map(|f| f.parts.iter().cloned().map(|slab| (slab, f.friction)))
        .chain(task.boxes.iter().flat_map(|b| b.slabs().into_iter().map(|slab| (slab, b.friction))));
    for (slab, friction) in slabs {
        let [x, y, z] = slab.half_extents;
        let collider = ColliderBuilder::cuboid(x, y, z).translation(Vec3::from_array(slab.position));
        world.insert_collider(surface(collider, friction), None);
    }
    let bodies: Vec<_> = drop_points(task, pour, dice)
        .into_iter()
        .zip(objects)
        .map(|(at, Placed { object, pose, .. })| {
            let at = Pose::from_parts(at + pose.translation, pose.rotation);
            let body =
                world.insert_body(RigidBodyBuilder::dynamic().pose(at).angular_damping(2.0).can_sleep(false));
            for (body_from_part, shape) in &object.parts {
                let Some((parry, upright)) = shape.to_parry() else { continue };
                // The object's mass by the parts' shares of its volume.
                let share = inertia::volume(shape)
                    / object.parts.iter().map(|(_, s)| inertia::volume(s)).sum::<f64>();
                let collider =
                    ColliderBuilder::new(parry).position(*body_from_part * upright).mass(object.mass * share);
                world.insert_collider(surface(collider, object.friction), Some(body));
            }
            body
        })
        .collect();
    let mut still = 0.0;
    let mut time = 0.0;
    while time < MAX_TIME_S && still < 0.25 {
        world.step();
        time += STEP_S;
        let fastest = bodies.iter().map(|b| world.bodies[*b].linvel().length()).fold(0.0, f64::max);
        still = if fastest < STILL { still + STEP_S } else { 0.0 };
    }
    let poses = bodies.iter().zip(objects).map(|(body, Placed { object, .. })| {
        let at = *world.bodies[*body].position();
        // A ball has no visible orientation.
        let ball = matches!(object.parts.as_slice(), [(_, Shape::Sphere { .. })]);
        if ball { Pose::from_translation(at.translation) } else { at }
    });
    poses.collect()
}

/// Friction of a pair is the geometric mean, as in our own contact law: the product of square roots.
fn surface(collider: ColliderBuilder, friction: f64) -> ColliderBuilder {
    collider.friction(friction.sqrt()).friction_combine_rule(CoefficientCombineRule::Multiply)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::place;
    use crate::seed::Seed;
    use crate::task::Placing;
    use std::sync::Arc;

    fn balls() -> Arc<Task> {
        Task::builtin().into_iter().find(|task| task.name == "balls").expect("built in")
    }

    fn poured(task: &Task, seed: u64) -> Vec<Vec3> {
        let placed = place(task, &mut SceneRng::new(Seed::from_u64(seed))).expect("they fit");
        placed.iter().map(|placed| placed.pose.translation).collect()
    }

    #[test]
    fn the_grid_is_that_of_2016() {
        let task = balls();
        let Placing::Pour(pour) = &task.place else { panic!("balls are poured") };
        let points = drop_points(&task, pour, &mut SceneRng::new(Seed::from_u64(1)));
        // Ten balls: four columns 0.11667 m apart, three rows 0.175 m apart, within the jitter.
        assert!((points[1].x - points[0].x - 0.11667).abs() < 0.0101);
        assert!((points[4].y - points[0].y - 0.175).abs() < 0.0101);
        assert!(points.iter().all(|p| p.z == 0.08));
    }

    #[test]
    fn balls_come_to_rest_in_their_box() {
        let (low, high) = balls().region("box_a").expect("it has a box A");
        for at in poured(&balls(), 3) {
            for k in 0..3 {
                assert!(at[k] > low[k] && at[k] < high[k], "{at}");
            }
        }
    }

    #[test]
    fn seeds_differ_and_repeat() {
        assert_eq!(poured(&balls(), 1), poured(&balls(), 1));
        assert_ne!(poured(&balls(), 1), poured(&balls(), 2));
    }
}
