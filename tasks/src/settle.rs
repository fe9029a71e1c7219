//! Pouring objects with rapier until they lie still.
//!
//! A pile of free objects needs no hand and no tendon: an ordinary rigid-body engine settles it. The result is
//! handed over at rest.

use crate::seed::Seed;
use crate::task::Task;
use palmares_models::Vec3;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rapier3d_f64::dynamics::{FrictionModel, RigidBodyBuilder};
use rapier3d_f64::geometry::ColliderBuilder;
use rapier3d_f64::pipeline::PhysicsWorld;

/// Longest pouring, s.
const LONGEST_S: f64 = 10.0;
const STEP_S: f64 = 1.0 / 240.0;
/// Slower than this is still, m/s.
const STILL: f64 = 5e-3;

/// Where the objects are dropped: layers of a jittered grid over part of their box, m.
pub fn drop_points(task: &Task, seed: Seed) -> Vec<Vec3> {
    let pour = &task.pour;
    let Some(target) = task.open_box(&pour.into) else { return Vec::new() };
    let mut random = ChaCha12Rng::from_seed(seed.0);
    let mut uniform = || 2.0 * ((random.next_u64() >> 11) as f64 / (1u64 << 53) as f64) - 1.0;
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
                target.center[0] + place(i % columns, columns, target.inner[0]) + pour.jitter * uniform(),
                target.center[1] + place(i / columns, rows, target.inner[1]) + pour.jitter * uniform(),
                pour.first_height + pour.layer_height * layer as f64,
            )
        })
        .collect()
}

/// Centres of the objects after pouring, m. Balls have no orientation to tell.
pub fn pour(task: &Task, seed: Seed) -> Vec<Vec3> {
    let mut world = PhysicsWorld::new();
    world.gravity = Vec3::new(0.0, 0.0, -9.81);
    let parameters = &mut world.integration_parameters;
    parameters.dt = STEP_S;
    parameters.length_unit = 0.1;
    parameters.friction_model = FrictionModel::Coulomb;
    parameters.contact_recycling = false;
    let slabs = task
        .furniture
        .iter()
        .flat_map(|f| f.parts.iter().cloned().map(|slab| (slab, f.friction)))
        .chain(task.boxes.iter().flat_map(|b| b.slabs().into_iter().map(|slab| (slab, b.friction))));
    for (slab, friction) in slabs {
        let [x, y, z] = slab.half_extents;
        let collider =
            ColliderBuilder::cuboid(x, y, z).translation(Vec3::from_array(slab.position)).friction(friction);
        world.insert_collider(collider, None);
    }
    let Some((shape, pose)) = task.objects.shape.to_parry() else { return Vec::new() };
    let bodies: Vec<_> = drop_points(task, seed)
        .into_iter()
        .map(|at| {
            let body = world.insert_body(
                RigidBodyBuilder::dynamic().translation(at).angular_damping(2.0).can_sleep(false),
            );
            let collider = ColliderBuilder::new(shape.clone())
                .position(pose)
                .mass(task.objects.mass)
                .friction(task.objects.friction);
            world.insert_collider(collider, Some(body));
            body
        })
        .collect();
    let mut still = 0.0;
    let mut time = 0.0;
    while time < LONGEST_S && still < 0.25 {
        world.step();
        time += STEP_S;
        let fastest = bodies.iter().map(|b| world.bodies[*b].linvel().length()).fold(0.0, f64::max);
        still = if fastest < STILL { still + STEP_S } else { 0.0 };
    }
    bodies.iter().map(|b| world.bodies[*b].translation()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_is_that_of_2016() {
        let task = &Task::builtin()[0];
        let points = drop_points(task, Seed::from_u64(1));
        // Ten balls: four columns 0.11667 m apart, three rows 0.175 m apart, within the jitter.
        assert!((points[1].x - points[0].x - 0.11667).abs() < 0.0101);
        assert!((points[4].y - points[0].y - 0.175).abs() < 0.0101);
        assert!(points.iter().all(|p| p.z == 0.08));
    }

    #[test]
    fn balls_come_to_rest_in_their_box() {
        let task = &Task::builtin()[0];
        let (low, high) = task.open_box("box_a").expect("it has a box A").inner_volume();
        for at in pour(task, Seed::from_u64(3)) {
            for k in 0..3 {
                assert!(at[k] > low[k] && at[k] < high[k], "{at}");
            }
        }
    }

    #[test]
    fn seeds_differ_and_repeat() {
        let task = &Task::builtin()[0];
        assert_eq!(pour(task, Seed::from_u64(1)), pour(task, Seed::from_u64(1)));
        assert_ne!(pour(task, Seed::from_u64(1)), pour(task, Seed::from_u64(2)));
    }
}
