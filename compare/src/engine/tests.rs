//! The engines we are compared with simulate the same scenes.

use super::{EngineKind, NotPlayed, rapier};
use palmares_bench::cases::{Setup, run, steps};
use palmares_bench::rigs::softhand;
use palmares_models::{Pose, Vec3};
use palmares_sim::{BaseCommand, Command, Config, Model, Push, State};
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
    assert!(message.contains("known engines: own, rapier, mujoco, drake"), "{message}");
    let message = EngineKind::from_names("mujoco", Some("stiff")).expect_err("refused").to_string();
    assert!(message.contains("known settings: default, ") && message.contains("stiff5"), "{message}");
    let message = EngineKind::from_names("drake", Some("soft")).expect_err("refused").to_string();
    assert!(
        message.contains("known settings: default, continuous, point_stiff, hydroelastic_margin, "),
        "{message}"
    );
}

#[test]
fn a_scene_that_an_adapter_does_not_pass_on_is_not_played() {
    let rapier = EngineKind::from_names("rapier", None).expect("it is known");
    let played = run("softhand_balls", &Setup::new(rapier.factory(), 4e-3));
    let failure = played.map(drop).expect_err("it is refused");
    assert!(failure.is::<NotPlayed>(), "{failure:?}");
    // On the floor, which has e = 0, the ball keeps its own 0.8: it bounces six times and more.
    assert!(run("bounce_zeno", &Setup::new(rapier.factory(), 4e-3)).is_ok(), "rapier gets restitution");
}

/// A SoftHand in rapier whose base is at rest and free, or held, after 10 ms under forces on its palm.
fn pushed(free: bool, forces: &[Vec3]) -> State {
    let model = Arc::new(
        Model::new(
            Config { gravity: Vec3::ZERO, ..Config::with_step(1e-3) },
            Some(softhand().expect("built in")),
        )
        .expect("a sound hand"),
    );
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut command = Command::stay(&model, Pose::IDENTITY);
    if free {
        command.base = BaseCommand::Free;
    }
    let point = model.hand().expect("it has one").links[0].inertia.com;
    command.pushes = forces.iter().map(|&force| Push { link: 0, point, force }).collect();
    let mut world = EngineKind::Rapier(&rapier::STIFF120).factory().start(model, state).expect("it starts");
    for _ in 0..10 {
        world.step(&command).expect("it steps");
    }
    command.pushes.clear();
    for _ in 0..10 {
        world.step(&command).expect("it steps");
    }
    world.state().clone()
}

#[test]
fn a_free_hand_in_rapier_flies_as_its_forces_push_it_and_no_longer() {
    let model = Model::new(Config::with_step(1e-3), Some(softhand().expect("built in"))).expect("sound");
    let mass: f64 = model.hand().expect("it has one").links.iter().map(|link| link.inertia.mass).sum();
    let force = Vec3::new(2.0, 0.0, 0.0);
    let speed = |state: State| state.v[0];
    // 10 ms of 2 N, twice.
    let expected = 2.0 * 0.01 / mass;
    let [once, twice, held] =
        [pushed(true, &[force]), pushed(true, &[force, force]), pushed(false, &[force])].map(speed);
    assert!((once / expected - 1.0).abs() < 0.3, "{once} {expected}");
    assert!((twice / once - 2.0).abs() < 0.1, "{twice} {once}");
    assert!(held.abs() < 0.2 * once, "the servo holds it: {held} {once}");
}
