//! The balls task with a hand of four motors and moment arms that depend on the configuration.

use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_tasks::action::{Action, BaseTarget};
use palmares_tasks::observation::Sensing;
use palmares_tasks::run::Run;
use palmares_tasks::seed::Seed;
use palmares_tasks::task::Task;

/// Palm down: a half turn about y, then `yaw` about the vertical.
fn down(yaw: f64) -> [f64; 4] {
    let (sin, cos) = (0.5 * yaw).sin_cos();
    [-sin, cos, 0.0, 0.0]
}

fn start(seed: u64) -> Run {
    let task = Task::builtin().into_iter().find(|task| task.name == "balls").expect("balls is built in");
    let hand = Hand::builtin("reflex").expect("the ReFlex is built in");
    Run::new(task, hand, Seed::from_u64(seed)).expect("the scene builds")
}

fn go(run: &mut Run, at: Vec3, yaw: f64, hand: [f64; 4], ticks: usize) {
    let base = Some(BaseTarget::Pose { position: at.to_array(), quat_xyzw: down(yaw) });
    let action = Action { base, hand: Some(hand.to_vec()) };
    for _ in 0..ticks {
        run.step(&action).expect("a valid action");
    }
    assert!(run.healthy());
}

#[test]
fn the_prediction_is_where_the_hand_comes_to_rest() {
    let mut run = start(1);
    assert!(run.check(&Action { base: None, hand: Some(vec![0.5]) }).is_err(), "it has four motors");
    go(&mut run, Vec3::new(0.0, 0.0, 0.75), 0.0, [0.8, 0.6, 0.4, 0.3], 400);
    let seen = run.observe(Sensing::Truth);
    let truth = seen.truth.expect("asked for");
    assert_eq!(truth.predicted_equilibrium.len(), 7);
    for (q, predicted) in truth.joints.position.iter().zip(&truth.predicted_equilibrium) {
        assert!((q - predicted).abs() < 1e-6, "{q} {predicted}");
    }
    let tensions: Vec<f64> = seen.hand.actuators.iter().map(|a| a.tension).collect();
    assert!(tensions[0] > tensions[1] && tensions[1] > tensions[2] && tensions[2] > 0.1, "{tensions:?}");
    assert!(tensions[3].abs() < 1e-6);
}
