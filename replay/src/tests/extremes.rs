//! Whatever action a run takes, its replay is accepted.

use super::*;
use palmares_tasks::action::ActionLimits;
use proptest::prelude::*;

/// Numbers of any size there is, and usual ones.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0f64,
        2 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        1 => prop::sample::select(vec![1e200, -1e200, f64::MAX, f64::MIN, 1e154, 5e-324, -0.0]),
    ]
}

fn action() -> impl Strategy<Value = Action> {
    let pose = (prop::array::uniform3(number()), prop::array::uniform4(number()))
        .prop_map(|(position, quat_xyzw)| BaseTarget::Pose { position, quat_xyzw });
    let twist = (prop::array::uniform3(number()), prop::array::uniform3(number()))
        .prop_map(|(linear, angular)| BaseTarget::Twist { linear, angular });
    let base = prop::option::of(prop_oneof![pose, twist]);
    let motors = || prop::option::of(prop::collection::vec(number(), 2));
    (base, motors(), motors()).prop_map(|(base, hand, effort)| Action { base, hand, effort })
}

fn applied_numbers(action: &Action) -> Vec<f64> {
    let base = match action.base.as_ref().expect("filled in") {
        BaseTarget::Pose { position, quat_xyzw } => [&position[..], &quat_xyzw[..]].concat(),
        BaseTarget::Twist { linear, angular } => [&linear[..], &angular[..]].concat(),
        BaseTarget::Joints { joints } => joints.clone(),
    };
    let effort = action.effort.iter().flatten().copied();
    base.into_iter().chain(action.hand.clone().expect("filled in")).chain(effort).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn what_a_run_accepts_its_replay_accepts(actions in prop::collection::vec(action(), 1..30)) {
        let folder = tempfile::tempdir().expect("folder");
        let scenario = Scenario::new("pinch", 0);
        let mut run = Run::new(Task::builtin().remove(0), scenario.hand.clone(), Seed::from_u64(5)).expect("scene");
        let recorder = Recorder::create(folder.path(), scenario.header, &run, &scenario.signer, None);
        let mut recorder = recorder.expect("recorder");
        let limits = ActionLimits::default();
        for action in &actions {
            if run.step(action).is_ok() {
                recorder.tick(&run);
                let most = limits.reach_m.max(limits.speed).max(limits.angular_speed) + 1e-12;
                prop_assert!(applied_numbers(run.applied()).iter().all(|x| x.abs() <= most));
            }
        }
        let outcome = run.finish(Reason::Stopped);
        let file = recorder.finish(&run, &outcome).expect("written");
        let verified = check(&std::fs::read(&file.path).expect("file"));
        prop_assert!(verified.is_ok(), "{}", verified.expect_err("refused"));
    }
}
