//! A run played again from its applied actions gives the same bits: what replays rest on.

use palmares_models::hand::Hand;
use palmares_tasks::action::{Action, BaseTarget};
use palmares_tasks::observation::{Sensing, Wrench};
use palmares_tasks::run::{PushError, Reason, Run};
use palmares_tasks::seed::Seed;
use palmares_tasks::task::Task;
use proptest::prelude::*;
use std::sync::{Arc, OnceLock};

const NO_WRENCH: Wrench = Wrench { force: [0.0; 3], torque: [0.0; 3] };

/// A task whose scene is built at once: one ball.
fn small_task() -> Arc<Task> {
    static TASK: OnceLock<Arc<Task>> = OnceLock::new();
    let text = include_str!("../balls/task.toml").replace("count = 10", "count = 1");
    TASK.get_or_init(|| Arc::new(Task::parse("small.toml", &text).expect("valid"))).clone()
}

fn start() -> Run {
    let hand = Hand::builtin("pinch").expect("built in");
    Run::new(small_task(), hand, Seed::from_u64(5)).expect("the scene builds")
}

fn actions() -> impl Strategy<Value = Vec<Action>> {
    let number = || prop_oneof![4 => -1.0..1.0f64, 1 => -9.0..9.0f64, 1 => Just(-0.0)];
    let pose = (prop::array::uniform3(number()), prop::array::uniform4(0.01..3.0f64))
        .prop_map(|(position, quat_xyzw)| BaseTarget::Pose { position, quat_xyzw });
    let twist = (prop::array::uniform3(number()), prop::array::uniform3(number()))
        .prop_map(|(linear, angular)| BaseTarget::Twist { linear, angular });
    let base = prop::option::of(prop_oneof![pose, twist]);
    let hand = prop::option::of(prop::collection::vec(-0.5..1.5f64, 2));
    prop::collection::vec((base, hand).prop_map(|(base, hand)| Action { base, hand }), 1..25)
}

fn bits(action: &Action) -> String {
    // Debug prints floats so that they read back as the same bits, and tells -0 from 0.
    format!("{action:?}")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn applied_actions_play_the_run_again(actions in actions()) {
        let (mut first, mut second) = (start(), start());
        for action in &actions {
            let before = first.digest();
            first.step(action).expect("valid");
            // Prepared, once or twice or not, is the same.
            for _ in 0..first.tick() % 3 {
                second.prepare();
            }
            prop_assert_eq!(second.digest(), before);
            second.step(first.applied()).expect("valid");
            prop_assert_eq!(bits(first.applied()), bits(second.applied()));
            prop_assert_eq!(first.state_hash(), second.state_hash());
        }
        second.prepare();
        let end = first.finish(Reason::Stopped);
        prop_assert_eq!(end, second.finish(Reason::Stopped));
    }
}

#[test]
fn a_push_moves_the_hand_while_it_lasts() {
    let mut run = start();
    let stay = Action::default();
    let base = |run: &Run| run.observe(Sensing::Sensors).hand.base.position;
    run.step(&stay).expect("valid");
    let before = base(&run);
    let link = run.hand().links[0].name.clone();
    let sideways = Wrench { force: [0.0, 100.0, 0.0], torque: [0.0; 3] };
    run.push(&link, sideways, 0.5).expect("a valid push");
    for _ in 0..50 {
        run.step(&stay).expect("valid");
    }
    // The servo is a spring of 2e4 N/m: 100 N are 5 mm.
    let moved = base(&run)[1] - before[1];
    assert!((moved - 5e-3).abs() < 2e-4, "{moved}");
    for _ in 0..100 {
        run.step(&stay).expect("valid");
    }
    assert!((base(&run)[1] - before[1]).abs() < 1e-4);
}

#[test]
fn a_torque_turns_the_hand_and_does_not_shift_it() {
    let mut run = start();
    let link = run.hand().links[0].name.clone();
    let about_z = Wrench { force: [0.0; 3], torque: [0.0, 0.0, 5.0] };
    run.push(&link, about_z, 1.0).expect("a valid push");
    for _ in 0..100 {
        run.step(&Action::default()).expect("valid");
    }
    let state = run.world().state();
    let turn =
        palmares_sim::actuation::base::shortest_turn(state.reference.pose.rotation, state.base.rotation);
    // 5 N·m on a spring of 500 N·m/rad.
    assert!((turn.z - 0.01).abs() < 5e-4 && turn.x.abs() < 1e-4 && turn.y.abs() < 1e-4, "{turn}");
    let shift = state.base.translation - state.reference.pose.translation;
    assert!(shift.length() < 1e-4, "{shift}");
}

#[test]
fn a_push_that_cannot_be_is_refused_with_what_could() {
    let mut run = start();
    let error = run.push("thumb_9", NO_WRENCH, 1.0).expect_err("no such link");
    let first = run.hand().links[0].name.clone();
    assert!(error.to_string().contains(&first), "{error}");
    let nan = Wrench { force: [f64::NAN, 0.0, 0.0], torque: [0.0; 3] };
    assert!(run.push(&first, nan, 1.0).is_err());
    assert!(run.push(&first, NO_WRENCH, 0.0).is_err());
    assert!(run.push(&first, NO_WRENCH, f64::INFINITY).is_err());
    for _ in 0..Run::PUSHES {
        run.push(&first, NO_WRENCH, 1.0).expect("there is room");
    }
    assert_eq!(run.push(&first, NO_WRENCH, 1.0), Err(PushError::TooMany));
}

#[test]
fn poses_are_those_of_the_observation_and_end_with_the_links() {
    let mut run = start();
    run.step(&Action::default()).expect("valid");
    let seen = run.observe(Sensing::Truth);
    let ball = seen.truth.expect("asked for").objects.position.0[0];
    let poses: Vec<_> = run.poses().collect();
    let bodies = run.hand_bodies();
    assert_eq!(poses.len(), 1 + bodies.len());
    assert_eq!(poses[0].0, 0);
    assert_eq!(poses[0].1.translation.to_array(), ball);
    for (body, (id, _)) in bodies.iter().zip(&poses[1..]) {
        assert_eq!(body.id, *id);
    }
    assert_eq!(bodies[0].id, run.scene().bodies.len());
    assert_eq!(poses[1].1.translation.to_array(), seen.hand.base.position);
}

#[test]
fn a_run_without_its_ball_left_is_over_by_time_only() {
    let text = include_str!("../balls/task.toml")
        .replace("count = 10", "count = 1")
        .replace("time_limit_s = 600.0", "time_limit_s = 0.02");
    let task = Arc::new(Task::parse("short.toml", &text).expect("valid"));
    let hand = Hand::builtin("pinch").expect("built in");
    let mut run = Run::new(task, hand, Seed::from_u64(5)).expect("the scene builds");
    run.step(&Action::default()).expect("valid");
    assert_eq!(run.over(), None);
    run.step(&Action::default()).expect("valid");
    assert_eq!(run.over(), Some(Reason::TimeLimit));
    let seen = run.observe(Sensing::Sensors);
    assert!(seen.truncated && !seen.terminated);
    assert_eq!(seen.reason.as_deref(), Some("time_limit"));
}
