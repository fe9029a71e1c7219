//! Initial scenes: at rest, without overlaps, in their regions, and equal on every machine.

use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, Model, State, World};
use palmares_tasks::Sensing;
use palmares_tasks::build::build;
use palmares_tasks::run::Run;
use palmares_tasks::seed::Seed;
use palmares_tasks::settle::Built;
use palmares_tasks::task::Task;
use parry3d_f64::query;
use std::sync::Arc;

fn task(name: &str) -> Arc<Task> {
    Task::builtin().into_iter().find(|task| task.name == name).expect("built in")
}

fn scene(task: &Task, seed: u64) -> Built {
    build(task, None, Seed::from_u64(seed)).expect("every seed has a scene")
}

/// World poses of an object's shapes.
fn shapes(model: &Model, state: &State, object: usize) -> Vec<(Pose, parry3d_f64::shape::SharedShape)> {
    let pose = state.object_pose(model, object);
    let parts = model.objects()[object].parts.iter();
    parts
        .map(|(body_from_part, shape)| {
            let (parry, upright) = shape.to_parry().expect("solid");
            (pose * *body_from_part * upright, parry)
        })
        .collect()
}

/// Objects within the region by all of their extent, no two in one another by more than a contact's give.
fn audit(task: &Task, built: &Built, seed: u64) {
    let (state, model) = (built.world.state(), built.world.model());
    let region = built
        .scene
        .regions
        .iter()
        .find(|r| Some(r.name.as_str()) == task.place.into_region())
        .expect("it is in the scene");
    let n = model.objects().len();
    let all: Vec<_> = (0..n).map(|k| shapes(model, state, k)).collect();
    for (k, parts) in all.iter().enumerate() {
        let name = &model.objects()[k].name;
        assert!(state.sleep[k].asleep, "seed {seed}: {name} moves");
        for (pose, shape) in parts {
            let around = shape.compute_aabb(pose);
            for axis in 0..3 {
                assert!(around.mins[axis] > region.min[axis] - 1e-3, "seed {seed}: {name} sticks out");
                assert!(around.maxs[axis] < region.max[axis] + 1e-3, "seed {seed}: {name} sticks out");
            }
        }
        for other in 0..k {
            for (pose, shape) in parts {
                for (pose_other, shape_other) in &all[other] {
                    let depth = query::contact(pose, &**shape, pose_other, &**shape_other, 0.0)
                        .expect("parry knows these shapes")
                        .map_or(0.0, |contact| -contact.dist);
                    let name_other = &model.objects()[other].name;
                    assert!(depth < 1e-3, "seed {seed}: {name} is {depth} m in {name_other}");
                }
            }
        }
    }
}

/// Maximum motion of an object in half a second without a hand, awake.
fn drift(built: &Built) -> f64 {
    let model = built.world.model();
    let mut state = built.world.state().clone();
    for sleep in &mut state.sleep {
        *sleep = palmares_sim::state::Sleep::default();
    }
    let mut world = World::new(Arc::clone(model), state.clone());
    let wait = Command::stay(model, Pose::IDENTITY);
    for _ in 0..500 {
        world.step(&wait);
    }
    let moved = world.state().objects.iter().zip(&state.objects);
    moved.map(|(now, before)| (now.translation - before.translation).length()).fold(0.0, f64::max)
}

#[test]
fn two_hundred_shelves_are_sound() {
    let task = task("shelf");
    let mut names = std::collections::BTreeSet::new();
    for seed in 0..200 {
        let built = scene(&task, seed);
        audit(&task, &built, seed);
        assert_eq!(built.world.model().objects().len(), 10);
        names.extend(built.world.model().objects().iter().map(|object| object.name.clone()));
        if seed % 10 == 0 {
            let moved = drift(&built);
            assert!(moved < 1e-3, "seed {seed}: something moves by {moved} m when left alone");
        }
    }
    assert_eq!(names.len(), task.objects.from.len(), "every object of the list has its turn");
}

#[test]
fn what_is_put_down_stays_as_it_stands() {
    // An object that topples would be lower, or lean.
    let task = task("shelf");
    for seed in 0..40 {
        let built = scene(&task, seed);
        for (k, object) in built.world.model().objects().iter().enumerate() {
            let pose = built.world.state().object_pose(built.world.model(), k);
            let lean = (pose.rotation * Vec3::Z).z.clamp(-1.0, 1.0).acos();
            let round = object.rolling_friction > 0.0;
            assert!(round || lean < 0.01, "seed {seed}: {} leans by {lean} rad", object.name);
        }
    }
}

#[test]
fn fifty_objects_on_the_table_are_sound() {
    let task = task("grasp");
    for seed in 0..50 {
        let built = scene(&task, seed);
        audit(&task, &built, seed);
        assert!(drift(&built) < 1e-3, "seed {seed}");
    }
}

#[test]
fn fifty_pours_of_balls_are_sound() {
    let task = task("balls");
    for seed in 0..50 {
        audit(&task, &scene(&task, seed), seed);
    }
}

#[test]
fn a_scene_has_all_that_stands_in_it() {
    let hand = Hand::builtin("softhand").expect("built in");
    let run = Run::new(task("shelf"), hand, Seed::from_u64(3)).expect("builds");
    let scene = run.scene();
    let free: Vec<_> = scene.bodies.iter().filter(|body| body.free).collect();
    assert_eq!(free.len(), 10);
    for (k, body) in free.iter().enumerate() {
        let object = &run.world().model().objects()[k];
        assert_eq!((body.id, body.name.as_str(), body.mass), (k, object.name.as_str(), object.mass));
        assert_eq!(body.parts.len(), object.parts.len());
        assert_eq!(body.com, object.com.to_array());
    }
    // Floor, two sides, back and roof; none where the hand goes in.
    let shelf = scene.bodies.iter().find(|body| body.name == "shelf").expect("it is in the scene");
    assert_eq!(shelf.parts.len(), 5);
    assert!(shelf.parts.iter().all(|part| part.position[1] > 0.45));
    let roles: Vec<_> = scene.regions.iter().map(|r| (r.name.as_str(), r.role.as_deref())).collect();
    assert_eq!(roles, [("shelf", Some("start")), ("box", Some("goal"))]);
    assert_eq!(scene.regions[0].min, [-0.2, 0.39999999999999997, 0.7]);
}

#[test]
fn a_scene_for_sensors_has_no_pose_of_an_object() {
    let scene = scene(&task("shelf"), 3).scene;
    assert_eq!(scene.clone().redacted_for(Sensing::Truth), scene);
    let redacted = scene.clone().redacted_for(Sensing::Sensors);
    for (body, full) in redacted.bodies.iter().zip(&scene.bodies) {
        assert_eq!((body.position.is_some(), body.quat_xyzw.is_some()), (!body.free, !body.free));
        assert_eq!((&body.name, &body.parts, body.mass), (&full.name, &full.parts, full.mass));
    }
    assert_eq!((redacted.regions, redacted.gravity), (scene.regions, scene.gravity));
}

#[test]
fn a_shelf_without_room_says_so() {
    let text =
        include_str!("../shelf/task.toml").replace("inner = [0.4, 0.4, 0.3]", "inner = [0.2, 0.2, 0.3]");
    let task = Task::parse("tight.toml", &text).expect("nobody has measured yet");
    let error = build(&task, None, Seed::from_u64(1)).err().expect("ten objects do not fit").to_string();
    assert!(error.contains("task `shelf`") && error.contains("found no room"), "{error}");
}

/// The file was written by a release build; the tests run in a debug build as well.
#[test]
fn every_build_reaches_the_same_scenes() {
    let golden = include_str!("golden/scenes.txt");
    let hand = Hand::builtin("softhand").expect("built in");
    let mut have = String::new();
    for name in ["balls", "shelf", "grasp"] {
        for seed in 1..=2 {
            let run = Run::new(task(name), hand.clone(), Seed::from_u64(seed)).expect("builds");
            have += &format!("{name} {seed} {}\n", run.state_hash());
        }
    }
    assert_eq!(have, golden);
}
