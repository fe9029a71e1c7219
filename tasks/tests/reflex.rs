//! The balls task with a hand of four motors and moment arms that depend on the configuration.

use palmares_models::hand::Hand;
use palmares_models::{Rotation, Vec3};
use palmares_sim::statics::equilibrium::solve_free;
use palmares_tasks::Sensing;
use palmares_tasks::action::{Action, BaseTarget};
use palmares_tasks::run::{Reason, Run};
use palmares_tasks::seed::Seed;
use palmares_tasks::task::Task;
use std::f64::consts::PI;

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
    let action = Action { base, hand: Some(hand.to_vec()), effort: None };
    for _ in 0..ticks {
        run.step(&action).expect("a valid action");
    }
    assert!(run.healthy());
}

#[test]
fn the_prediction_is_where_the_hand_comes_to_rest() {
    let mut run = start(1);
    assert!(
        run.check(&Action { base: None, hand: Some(vec![0.5]), effort: None }).is_err(),
        "it has four motors"
    );
    go(&mut run, Vec3::new(0.0, 0.0, 0.75), 0.0, [0.8, 0.6, 0.4, 0.3], 400);
    let observation = run.observe(Sensing::Truth);
    let truth = observation.truth.expect("it is observed");
    assert_eq!(truth.predicted_equilibrium.0.len(), 7);
    for (q, predicted) in truth.joints.position.0.iter().zip(&truth.predicted_equilibrium.0) {
        assert!((q - predicted).abs() < 1e-6, "{q} {predicted}");
    }
    let tensions = observation.hand.column("motors", "tension");
    assert!(tensions[0] > tensions[1] && tensions[1] > tensions[2] && tensions[2] > 0.1, "{tensions:?}");
    assert!(tensions[3].abs() < 1e-6);
}

/// Centre of a ball in the hand's frame when the fingers close on it: midway between them, off the palm.
const BALL_IN_HAND: Vec3 = Vec3::new(0.015, 0.0, 0.155);
const BALL_RADIUS: f64 = 0.05;
/// Half the inner width of a box.
const HALF_BOX: f64 = 0.25;
/// Fingers half closed on the way down, so that they fit between the other balls.
const ON_THE_WAY: [f64; 4] = [0.43, 0.43, 0.43, 0.4];
const CLOSED: [f64; 4] = [0.9, 0.9, 0.9, 0.4];

/// Parts of the hand on its way down that could strike something, in its frame.
fn probes(hand: &Hand) -> Vec<Vec3> {
    let s: Vec<f64> = hand.tendons.iter().map(|t| t.wound(&hand.motors, |motor| ON_THE_WAY[motor])).collect();
    let open: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    let q = solve_free(hand, &s, &vec![0.0; open.len()], &open).expect("it has an equilibrium").q;
    let poses = hand.base_from_links(&q);
    let mut all = Vec::new();
    for (link, pose) in hand.links.iter().zip(&poses) {
        if link.name.starts_with("distal") {
            all.extend([0.0, 0.025, 0.05].map(|x| pose.transform_point(Vec3::new(x, 0.0, 0.007))));
        }
    }
    all
}

/// The ball with most room around the fingers, and the yaw at which it has it.
fn easiest(balls: &[Vec3], hand: &Hand) -> (usize, f64) {
    let probes = probes(hand);
    let mut best = (f64::NEG_INFINITY, 0, 0.0);
    for (i, ball) in balls.iter().enumerate() {
        for k in 0..24 {
            let yaw = f64::from(k) * PI / 12.0;
            let [x, y, z, w] = down(yaw);
            let turn = Rotation::from_xyzw(x, y, z, w);
            let mut room = f64::INFINITY;
            for probe in &probes {
                let at = *ball + turn * (*probe - BALL_IN_HAND);
                room = room.min(HALF_BOX - at.x.abs()).min(HALF_BOX - at.y.abs());
                for (j, other) in balls.iter().enumerate() {
                    if j != i {
                        room = room.min((at - *other).length() - BALL_RADIUS);
                    }
                }
            }
            if room > best.0 {
                best = (room, i, yaw);
            }
        }
    }
    (best.1, best.2)
}

/// One ball from box to box, as a controller would do it.
#[test]
fn a_ball_is_brought_from_box_to_box() {
    for seed in 1..=5 {
        let mut run = start(seed);
        let hand = Hand::builtin("reflex").expect("the ReFlex is built in");
        let balls: Vec<Vec3> = run.world().state().objects.iter().map(|pose| pose.translation).collect();
        let (ball, yaw) = easiest(&balls, &hand);
        let [x, y, z, w] = down(yaw);
        let at = balls[ball] - Rotation::from_xyzw(x, y, z, w) * BALL_IN_HAND;
        let up = |z: f64| Vec3::new(at.x, at.y, z);
        go(&mut run, up(0.6), yaw, ON_THE_WAY, 150);
        go(&mut run, at, yaw, ON_THE_WAY, 100);
        go(&mut run, at, yaw, CLOSED, 120);
        go(&mut run, up(0.6), yaw, CLOSED, 100);
        let lifted = run.world().state().objects[ball].translation.z;
        assert!(lifted > 0.3, "seed {seed}: ball {ball} is at {lifted} m");
        go(&mut run, Vec3::new(0.7, 0.0, 0.6), yaw, CLOSED, 150);
        go(&mut run, Vec3::new(0.7, 0.0, 0.35), yaw, CLOSED, 80);
        go(&mut run, Vec3::new(0.7, 0.0, 0.35), yaw, [0.0, 0.0, 0.0, 0.4], 150);
        let outcome = run.finish(Reason::Stopped);
        assert_eq!((outcome.in_goal, outcome.outside), (1, 0), "seed {seed}");
    }
}
