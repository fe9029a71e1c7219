//! The ground has no end: what is thrown over it stays on it.

use palmares_models::{Pose, Vec3};
use palmares_sim::Command;
use palmares_tasks::build::build;
use palmares_tasks::seed::Seed;
use palmares_tasks::task::Task;
use std::sync::Arc;

fn task(name: &str) -> Arc<Task> {
    Task::builtin().into_iter().find(|task| task.name == name).expect("built in")
}

/// Throws every object of a scene away, each another way, and looks after it for a minute.
fn throw(name: &str, seed: u64) {
    let task = task(name);
    let built = build(&task, None, Seed::from_u64(seed)).expect("every seed has a scene");
    let (mut world, height) = (built.world, task.ground.height);
    let model = Arc::clone(world.model());
    let state = world.state_mut();
    for k in 0..model.objects().len() {
        let (sin, cos) = (1.0 + k as f64).sin_cos();
        let at = Vec3::new(4.0 * cos, 4.0 * sin, height + 1.0);
        state.objects[k] = Pose::from_parts(at, state.objects[k].rotation);
        state.sleep[k] = palmares_sim::state::Sleep::default();
        let v = &mut state.v[model.object_dofs(k)..][..6];
        v.copy_from_slice(&[15.0 * cos, 15.0 * sin, -3.0, 20.0 * sin, -20.0 * cos, 5.0]);
    }
    let stay = Command::stay(&model, Pose::IDENTITY);
    let mut farthest = 0.0f64;
    for _ in 0..(60.0 / task.step_s) as u64 {
        world.step(&stay);
        for (k, pose) in world.state().objects.iter().enumerate() {
            let at = pose.translation;
            farthest = farthest.max(at.truncate().length());
            let name = &model.objects()[k].name;
            assert!(at.z > height, "{name} is {} m below the ground", height - at.z);
        }
    }
    assert_eq!(world.fault(), None);
    // Beyond what is drawn, and beyond where the ground ended once.
    assert!(farthest > 5.0, "they were thrown {farthest} m");
    for (k, pose) in world.state().objects.iter().enumerate() {
        assert!(pose.translation.z < height + 0.3, "{} is still in the air", model.objects()[k].name);
    }
}

#[test]
fn balls_stay_on_the_ground() {
    throw("balls", 1);
}

#[test]
fn what_was_in_the_shelf_stays_on_the_ground() {
    for seed in [100, 101] {
        throw("shelf", seed);
    }
}

#[test]
fn the_scene_has_the_ground() {
    for task in Task::builtin() {
        let built = build(&task, None, Seed::from_u64(1)).expect("every seed has a scene");
        let endless: Vec<_> = built.scene.bodies.iter().filter(|body| body.endless).collect();
        let [ground] = endless.as_slice() else { panic!("one ground, not {}", endless.len()) };
        let [part] = ground.parts.as_slice() else { panic!("one part") };
        let palmares_models::shape::Shape::Box { half_extents, .. } = part.shape else { panic!("a box") };
        assert!((part.position[2] + half_extents[2] - task.ground.height).abs() < 1e-12);
        assert_eq!((ground.name.as_str(), ground.free, ground.friction), ("ground", false, 0.5));
    }
}
