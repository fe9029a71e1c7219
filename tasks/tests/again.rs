//! A run played again from its applied actions gives the same bits: what replays rest on.

use palmares_models::hand::Hand;
use palmares_sim::SharedScratch;
use palmares_tasks::Sensing;
use palmares_tasks::action::{Action, ActionError, ActionLimits, BaseTarget};
use palmares_tasks::observation::Wrench;
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
    let number = || {
        prop_oneof![
            6 => -1.0..1.0f64,
            2 => -9.0..9.0f64,
            1 => Just(-0.0),
            // All magnitudes, down to subnormal ones.
            2 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
            1 => prop::sample::select(vec![1e200, -1e200, f64::MAX, f64::MIN, 1e154, 5e-324, 1e-200]),
        ]
    };
    let pose = (prop::array::uniform3(number()), prop::array::uniform4(number()))
        .prop_map(|(position, quat_xyzw)| BaseTarget::Pose { position, quat_xyzw });
    let twist = (prop::array::uniform3(number()), prop::array::uniform3(number()))
        .prop_map(|(linear, angular)| BaseTarget::Twist { linear, angular });
    let base = prop::option::of(prop_oneof![pose, twist]);
    let sigma = prop_oneof![9 => -0.5..1.5f64, 1 => number()];
    let hand = prop::option::of(prop::collection::vec(sigma, 2));
    let effort = prop::option::weighted(0.2, prop::collection::vec(-0.5..1.5f64, 2));
    let action = (base, hand, effort).prop_map(|(base, hand, effort)| Action { base, hand, effort });
    prop::collection::vec(action, 1..25)
}

fn bits(action: &Action) -> String {
    // Debug prints floats so that they read back as the same bits, and distinguishes -0 from 0.
    format!("{action:?}")
}

/// Whether the applied action is within the limits, and as near to the requested one as they allow.
fn within_limits(requested: &Action, applied: &Action) -> bool {
    let limits = ActionLimits::default();
    let cosine = |a: &[f64], b: &[f64]| {
        let unit = |v: &[f64]| {
            let most = v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let scaled: Vec<f64> = v.iter().map(|x| x / most).collect();
            let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
            scaled.into_iter().map(move |x| x / length).collect::<Vec<_>>()
        };
        unit(a).iter().zip(unit(b)).map(|(a, b)| a * b).sum::<f64>()
    };
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let clipped = |requested: &[f64; 3], applied: &[f64; 3], most: f64| {
        let over = requested.iter().any(|x| x.abs() > most);
        let all = if over { (length(applied) - most).abs() < 1e-12 } else { length(applied) < most + 1e-12 };
        all && (requested.iter().all(|x| x.abs() < 1e-300) || cosine(requested, applied) > 1.0 - 1e-12)
    };
    let base = match (&requested.base, &applied.base) {
        (
            Some(BaseTarget::Pose { quat_xyzw: requested, .. }),
            Some(BaseTarget::Pose { position, quat_xyzw }),
        ) => {
            position.iter().all(|x| x.abs() <= limits.reach_m)
                && (length(quat_xyzw) - 1.0).abs() < 1e-14
                && cosine(requested, quat_xyzw) > 1.0 - 1e-12
        }
        (Some(BaseTarget::Twist { linear: a, angular: b }), Some(BaseTarget::Twist { linear, angular })) => {
            clipped(a, linear, limits.speed) && clipped(b, angular, limits.angular_speed)
        }
        (None, _) => true,
        _ => false,
    };
    base && applied.hand.iter().chain(&applied.effort).flatten().all(|x| (0.0..=1.0).contains(x))
}

#[test]
fn a_velocity_of_any_size_is_clipped_to_the_limit_in_its_direction() {
    let mut run = start();
    for size in [3.0, 1e154, 1e200, f64::MAX] {
        let base = Some(BaseTarget::Twist { linear: [size, -size, 0.0], angular: [0.0, 0.0, -size] });
        run.step(&Action { base, hand: None, effort: None }).expect("finite");
        let Some(BaseTarget::Twist { linear, angular }) = run.applied().base else { panic!("a velocity") };
        let half = 2.0 * std::f64::consts::FRAC_1_SQRT_2;
        let expected = [half, -half, 0.0];
        assert!(linear.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{size}: {linear:?}");
        assert!((angular[2] + 3.0).abs() < 1e-14, "{size}: {angular:?}");
    }
}

#[test]
fn a_quaternion_of_any_length_but_none_is_a_direction() {
    let mut run = start();
    let turned = |x: f64| {
        let base = BaseTarget::Pose { position: [0.0, 0.0, 0.75], quat_xyzw: [0.0, x, 0.0, -x] };
        Action { base: Some(base), hand: None, effort: None }
    };
    for size in [1e-6, 0.5, 1e154, 1e200, f64::MAX] {
        run.step(&turned(size)).expect("it has a direction");
        let Some(BaseTarget::Pose { quat_xyzw: [_, y, _, w], .. }) = run.applied().base else {
            panic!("a pose")
        };
        assert!((y - 0.5f64.sqrt()).abs() < 1e-15 && (y + w).abs() < 1e-15, "{size}: {y} {w}");
    }
    for size in [0.0, 5e-324, 1e-200, 7e-7] {
        assert_eq!(run.step(&turned(size)), Err(ActionError::ZeroQuaternion), "{size}");
    }
}

#[test]
fn runs_that_take_turns_in_the_same_memory_go_as_they_do_alone() {
    let [pinch, softhand] = ["pinch", "softhand"].map(|name| Hand::builtin(name).expect("built in"));
    let open = |(hand, seed): (&Arc<Hand>, u64)| {
        Run::new(small_task(), hand.clone(), Seed::from_u64(seed)).expect("the scene builds")
    };
    // The second is of another hand and keeps to its own memory.
    let runs = || [(&softhand, 6), (&pinch, 6), (&softhand, 7), (&softhand, 8)].map(open);
    let (mut turns, mut alone) = (runs(), runs());
    let mut memory = SharedScratch::default();
    let down = Action {
        base: Some(BaseTarget::Twist { linear: [0.0, 0.0, -0.5], angular: [0.0; 3] }),
        hand: None,
        effort: None,
    };
    let mut touched = 0;
    for tick in 0..120 {
        for (run, alone) in turns.iter_mut().zip(&mut alone) {
            run.exchange(&mut memory);
            run.step(&down).expect("valid");
            run.exchange(&mut memory);
            alone.step(&down).expect("valid");
            assert_eq!(run.digest(), alone.digest(), "tick {tick}");
            touched += run.world().contact_forces().len();
        }
    }
    assert!(touched > 0, "hands that touch nothing prove little");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn applied_actions_play_the_run_again(actions in actions()) {
        let (mut first, mut second) = (start(), start());
        for action in &actions {
            let before = first.digest();
            if first.check(action).is_err() {
                // Numbers of any size are fine; a quaternion without a direction is not.
                let shortest = match &action.base {
                    Some(BaseTarget::Pose { quat_xyzw, .. }) => quat_xyzw.iter().all(|x| x.abs() < 1e-6),
                    _ => false,
                };
                prop_assert!(shortest, "{:?}", action);
                prop_assert!(first.step(action).is_err());
                continue;
            }
            first.step(action).expect("valid");
            prop_assert!(within_limits(action, first.applied()), "{:?}: {:?}", action, first.applied());
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
    let base = |run: &Run| run.observe(Sensing::Sensors).hand.column("base", "position");
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
    for _ in 0..Run::MAX_PUSHES {
        run.push(&first, NO_WRENCH, 1.0).expect("there is room");
    }
    assert_eq!(run.push(&first, NO_WRENCH, 1.0), Err(PushError::TooMany));
}

#[test]
fn poses_are_those_of_the_observation_and_end_with_the_links() {
    let mut run = start();
    run.step(&Action::default()).expect("valid");
    let observation = run.observe(Sensing::Truth);
    let ball = observation.truth.expect("it is observed").objects.position.0[0];
    let poses: Vec<_> = run.poses().collect();
    let bodies = run.hand_bodies();
    assert_eq!(poses.len(), 1 + bodies.len());
    assert_eq!(poses[0].0, 0);
    assert_eq!(poses[0].1.translation.to_array(), ball);
    for (body, (id, _)) in bodies.iter().zip(&poses[1..]) {
        assert_eq!(body.id, *id);
    }
    assert_eq!(bodies[0].id, run.scene().bodies.len());
    assert_eq!(poses[1].1.translation.to_array()[..], observation.hand.column("base", "position"));
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
    let observation = run.observe(Sensing::Sensors);
    assert!(observation.truncated && !observation.terminated);
    assert_eq!(observation.reason.as_deref(), Some("time_limit"));
}
