//! The engines we are compared with simulate the same scenes.

use super::{EngineKind, rapier};
use crate::child::Task;
use crate::played::Played;
use palmares_bench::cases::{Setup, run, steps};
use palmares_bench::rigs::softhand;
use palmares_models::Pose;
use palmares_sim::{Command, Config, Model, State};
use std::sync::Arc;

/// Coordinates of a hand after 0.32 s of closing on air, with steps of 8 ms.
fn closing(engine: EngineKind) -> Vec<f64> {
    let hand = softhand().expect("built in");
    let model = Arc::new(Model::new(Config::with_step(8e-3), Some(hand)).expect("a sound hand"));
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut command = Command::stay(&model, Pose::IDENTITY);
    let mut world = engine.factory().start(model, state).expect("the engine starts");
    command.sigma[0] = 0.3;
    for _ in 0..steps(0.32, 8e-3) {
        world.step(&command).expect("it steps");
    }
    world.state().q.clone()
}

#[test]
fn a_free_hand_moves_in_rapier_as_in_ours() {
    let (own, rapier) = (closing(EngineKind::Own), closing(EngineKind::Rapier(&rapier::STIFF120)));
    assert!(own.iter().any(|q| *q > 0.05), "it moves: {own:?}");
    for (a, b) in own.iter().zip(&rapier) {
        assert!((a - b).abs() < 2e-3, "{own:?} {rapier:?}");
    }
}

#[test]
fn rapier_stops_a_sliding_cube_near_where_coulomb_says() {
    let setup = Setup::new(&rapier::STIFF120, 2e-3);
    let (report, _) = run("slide_stop", &setup).expect("the case runs");
    let error = report.error.value.expect("an analytic answer");
    assert!(error <= 1.0, "{error} %");
}

#[test]
fn unknown_names_are_refused_with_the_known_ones() {
    let message = EngineKind::from_names("other", None).expect_err("refused").to_string();
    assert!(message.contains("known engines: own, rapier, mujoco"), "{message}");
    let message = EngineKind::from_names("mujoco", Some("stiff")).expect_err("refused").to_string();
    assert!(message.contains("known settings: default, ") && message.contains("stiff5"), "{message}");
}

#[test]
fn a_scene_that_an_adapter_does_not_pass_on_is_not_played() {
    let [kind, rapier] =
        ["mujoco", "rapier"].map(|name| EngineKind::from_names(name, None).expect("it is known"));
    let task = |name: &str| Task::Case { name: name.to_owned(), reference_dt_s: None, start: 0 };
    let ended = task("bounce_zeno").play::<Played>(kind, 4e-3, 60.0).expect("no child is needed");
    let failure = ended.expect_err("it is refused before MuJoCo is started");
    assert!(failure.not_played && !failure.unfinished, "{failure:?}");
    // On the floor, which has e = 0, the ball keeps its own 0.8: it bounces six times and more.
    assert!(run("bounce_zeno", &Setup::new(rapier.factory(), 4e-3)).is_ok(), "rapier gets restitution");
}
