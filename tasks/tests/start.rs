//! The initial pose of the hand: the scene does not depend on it, and it must not be in the way.

use palmares_models::hand::{Geom, Hand};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_tasks::build::build;
use palmares_tasks::overlap::Obstacle;
use palmares_tasks::run::Run;
use palmares_tasks::settle::Built;
use palmares_tasks::start::{hand_start, may_overlap, overlaps, start_pose};
use palmares_tasks::{SceneError, Seed, Sensing, Task};
use std::sync::Arc;

/// A hand with a plate fixed to its palm, which at the task's start is at `at` in the world.
fn with_plate(hand: &Hand, task: &Task, at: Vec3, half_extents: [f64; 3]) -> Arc<Hand> {
    // A plate as far away as these makes the hand begin 0.3 m farther back, the most that there is.
    let begins_back = start_pose(task) * Pose::from_translation(Vec3::Z * -0.3);
    let mut hand = hand.clone();
    hand.links[0].geoms.push(Geom {
        shape: Shape::Box { half_extents, rounding: 0.0 },
        link_from_geom: begins_back.inverse() * Pose::from_translation(at),
        friction: 0.6,
    });
    Arc::new(hand)
}

fn hands() -> Vec<Arc<Hand>> {
    ["softhand", "reflex", "pinch"].map(|name| Hand::builtin(name).expect("built in")).to_vec()
}

/// Every bit of the objects' poses and sleep, and of the scene's description.
fn bits(built: &Built) -> String {
    let state = built.world.state();
    // Debug prints floats so that they read back as the same bits.
    format!("{:?} {:?} {:?}", state.objects, state.sleep, built.scene)
}

/// Names of what a hand overlaps, and what it is.
fn refused(result: Result<Built, SceneError>) -> Vec<(Obstacle, String)> {
    match result {
        Err(SceneError::HandInTheWay { overlaps, .. }) => {
            overlaps.into_iter().map(|o| (o.obstacle, o.name)).collect()
        }
        Err(other) => panic!("{other}"),
        Ok(_) => Vec::new(),
    }
}

#[test]
fn a_scene_is_the_same_for_every_hand_and_for_none() {
    for task in Task::builtin() {
        let mut hands = hands();
        // Two that reach far into the room and touch nothing: high above the scene, and 3 cm over all objects.
        // Nothing starts in the region that objects go into; where each has a place of its own there is none.
        let region = task.place.into_region().and_then(|name| task.region(name));
        let room = region.or_else(|| palmares_tasks::place::placing_room(&task));
        let (low, high) = room.expect("the task's own");
        let over = Vec3::new(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), high[2] + 0.03);
        for at in [over, over + Vec3::new(0.0, 0.0, 0.5)] {
            hands.push(with_plate(&hands[2], &task, at, [0.1, 0.1, 0.01]));
        }
        for seed in (0..15).map(Seed::from_u64) {
            let alone = bits(&build(&task, None, seed).expect("every seed has a scene"));
            for hand in &hands {
                let built = build(&task, Some(hand.clone()), seed);
                let built = built.unwrap_or_else(|error| panic!("{} {}: {error}", task.name, hand.name));
                assert!(bits(&built) == alone, "{} with {}, {seed:?}", task.name, hand.name);
            }
        }
    }
}

#[test]
fn the_hand_is_at_rest_and_wakes_nothing_in_the_first_tick() {
    for task in Task::builtin() {
        for hand in hands() {
            let mut run = Run::new(task.clone(), hand.clone(), Seed::from_u64(2)).expect("the scene builds");
            let before = run.world().state().clone();
            let wrist = run.observe(Sensing::Sensors).hand.of("wrist").to_vec();
            assert_eq!(before.step, 0);
            run.step(&palmares_tasks::Action::default()).expect("valid");
            let after = run.world().state();
            assert_eq!(before.objects, after.objects, "{} {}", task.name, hand.name);
            assert!(after.sleep.iter().all(|sleep| sleep.asleep), "{} {}", task.name, hand.name);
            let now = run.observe(Sensing::Sensors).hand.of("wrist").to_vec();
            for (a, b) in wrist.iter().zip(&now) {
                assert!((a - b).abs() < 1e-3, "{} {}: {wrist:?} {now:?}", task.name, hand.name);
            }
            let moved = (after.base.translation - before.base.translation).length();
            assert!(moved < 1e-5, "{} {}: the base moves by {moved} m", task.name, hand.name);
            for (q, earlier) in after.q.iter().zip(&before.q) {
                assert!((q - earlier).abs() < 1e-3, "{} {}: a joint moves", task.name, hand.name);
            }
        }
    }
}

#[test]
fn a_plate_in_the_shelf_is_refused_for_every_seed() {
    let task = Task::builtin().into_iter().find(|task| task.name == "shelf").expect("built in");
    let at = Vec3::new(0.0, 0.6, 0.72);
    let hand = with_plate(&hands()[2], &task, at, [0.05, 0.05, 0.002]);
    let expected = (Obstacle::Region, "shelf".to_owned());
    for seed in 0..15 {
        let found = refused(build(&task, Some(hand.clone()), Seed::from_u64(seed)));
        assert!(found.contains(&expected), "seed {seed}: {found:?}");
    }
    let found = overlaps(&task, hand).expect("it can be simulated");
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].to_string(), format!("link `{}` reaches into region `shelf`", found[0].link));
    for hand in hands() {
        assert_eq!(overlaps(&task, hand).expect("it can be simulated"), []);
    }
}

#[test]
fn what_touches_furniture_or_objects_is_refused() {
    let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
    let pinch = &hands()[2];
    // Half in the table, next to the objects' region.
    let at = Vec3::new(0.4, 0.4, 0.0);
    let low = with_plate(pinch, &task, at, [0.05, 0.05, 0.01]);
    let found = overlaps(&task, low).expect("it can be simulated");
    assert_eq!(
        found.iter().map(|o| (o.obstacle, o.name.as_str())).collect::<Vec<_>>(),
        [(Obstacle::Furniture, "table")]
    );
    // Over the table and through any object there.
    let at = Vec3::new(0.0, 0.0, 0.03);
    let high = with_plate(pinch, &task, at, [0.12, 0.12, 0.01]);
    assert_eq!(overlaps(&task, high.clone()).expect("it can be simulated"), [], "no seed, no object");
    let known: Vec<Obstacle> = may_overlap(&task, high.clone())
        .expect("it can be simulated")
        .iter()
        .map(|overlap| overlap.obstacle)
        .collect();
    assert_eq!(known, [Obstacle::Placing], "without any seed it is known that it will");
    for seed in (0..15).map(Seed::from_u64) {
        let object = build(&task, None, seed).expect("every seed has a scene").scene.bodies[0].name.clone();
        assert_eq!(refused(build(&task, Some(high.clone()), seed)), [(Obstacle::Object, object)]);
    }
}

/// No object of any seed is outside the volume that hands must avoid, and the built-in hands are outside.
#[test]
fn objects_are_placed_in_the_room_that_hands_keep_out_of() {
    for task in Task::builtin() {
        // Nothing starts in the region that objects go into; where each has a place of its own there is none.
        let region = task.place.into_region().and_then(|name| task.region(name));
        let room = region.or_else(|| palmares_tasks::place::placing_room(&task));
        let (low, high) = room.expect("the task's own");
        for seed in (0..15).map(Seed::from_u64) {
            let scene = build(&task, None, seed).expect("every seed has a scene").scene;
            for body in scene.bodies.iter().filter(|body| body.free) {
                let name = &body.name;
                for part in &body.parts {
                    let (shape, upright) = part.shape.to_parry().expect("a solid");
                    let pose = |at: [f64; 3], [x, y, z, w]: [f64; 4]| {
                        Pose::from_parts(
                            Vec3::from_array(at),
                            palmares_models::Rotation::from_xyzw(x, y, z, w),
                        )
                    };
                    let body = pose(
                        body.position.expect("the builder knows it"),
                        body.quat_xyzw.expect("the builder knows it"),
                    );
                    let at = body * pose(part.position, part.quat_xyzw) * upright;
                    let around = shape.compute_aabb(&at);
                    for k in 0..3 {
                        // Settled bodies sink in by less than a tenth of a millimetre.
                        let inside = around.mins[k] > low[k] - 1e-3 && around.maxs[k] < high[k] + 1e-3;
                        assert!(inside, "{name} of {}, {seed:?}", task.name);
                    }
                }
            }
        }
        for hand in hands() {
            assert_eq!(may_overlap(&task, hand).expect("it can be simulated"), [], "{}", task.name);
        }
    }
}

/// A hand that is longer than usual begins farther back by the difference: above the objects, in every task. The built-in hands
/// begin at the tasks' poses, bit for bit.
#[test]
fn a_long_hand_begins_above_the_objects() {
    for task in Task::builtin() {
        for hand in hands() {
            assert_eq!(hand_start(&task, &hand), start_pose(&task), "{}", hand.name);
        }
        let mut long = hands()[2].as_ref().clone();
        let at = Pose::from_translation(Vec3::new(0.0, 0.0, 0.3));
        let rod = Shape::Box { half_extents: [0.01, 0.01, 0.25], rounding: 0.0 };
        long.links[0].geoms.push(Geom { shape: rod, link_from_geom: at, friction: 0.6 });
        let back = start_pose(&task).inverse() * hand_start(&task, &long);
        assert!((back.translation - Vec3::new(0.0, 0.0, -0.25)).length() < 1e-9, "{back:?}");
        assert_eq!(may_overlap(&task, Arc::new(long)).expect("it can be simulated"), [], "{}", task.name);
    }
}
