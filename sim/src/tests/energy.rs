//! A hand without dampers keeps its energy.

use crate::config::BaseConfig;
use crate::dynamics::tree::Kinematics;
use crate::{Command, Config, Model, State, World};
use palmares_models::hand::Hand;
use palmares_models::{Mat3, Pose};
use std::sync::Arc;

fn undamped(springs: bool) -> Arc<Hand> {
    let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
    hand.gravity_compensation = false;
    hand.no_collision =
        (0..hand.links.len()).flat_map(|a| (a + 1..hand.links.len()).map(move |b| [a, b])).collect();
    for c in &mut hand.coordinates {
        (c.damping, c.lower, c.upper) = (0.0, -1e6, 1e6);
        if !springs {
            c.stiffness = 0.0;
        }
    }
    // Slack tendons.
    for motor in &mut hand.motors {
        motor.offset = 10.0;
    }
    Arc::new(hand)
}

/// Kinetic, potential and elastic energy, J.
fn energy(world: &World) -> (f64, f64) {
    let (model, state) = (world.model(), world.state());
    let hand = model.hand().expect("a hand");
    let mut kin = Kinematics::default();
    kin.update(hand, state.base, &state.q);
    let mut velocity = Vec::new();
    kin.velocities(hand, &state.v[..model.hand_dofs()], &mut velocity);
    let (mut kinetic, mut stored) = (0.0, 0.0);
    for (i, link) in hand.links.iter().enumerate() {
        let com = kin.pose[i].transform_point(link.inertia.com);
        let v = velocity[i].at(com - kin.origin);
        let r = Mat3::from_quat(kin.pose[i].rotation);
        let w = r.transpose() * velocity[i].angular;
        kinetic += 0.5 * link.inertia.mass * v.length_squared() + 0.5 * w.dot(link.inertia.about_com * w);
        stored -= link.inertia.mass * model.config().gravity.dot(com);
    }
    for (q, c) in state.q.iter().zip(&hand.coordinates) {
        stored += 0.5 * c.stiffness * (q - c.rest).powi(2);
    }
    (kinetic, stored)
}

/// Largest deviation of the energy within 2 s, relative to the largest kinetic energy.
fn drift(springs: bool, step_s: f64) -> f64 {
    let mut config = Config::with_step(step_s);

    // A base that is as good as welded to the world, without dampers.
    config.base = BaseConfig {
        stiffness: 1e9,
        angular_stiffness: 1e7,
        damping: 0.0,
        angular_damping: 0.0,
        force_limit: 1e9,
        torque_limit: 1e9,
        ..config.base
    };
    let model = Model::new(config, Some(undamped(springs))).expect("a hand");
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    if springs {
        state.q.fill(0.2);
    }
    let mut world = World::new(Arc::new(model), state);
    let command = Command::stay(world.model(), Pose::IDENTITY);
    let (kinetic, stored) = energy(&world);
    let start = kinetic + stored;
    let (mut worst, mut most) = (0.0f64, 0.0f64);
    for _ in 0..(2.0 / step_s) as u32 {
        assert!(world.step(&command).converged);
        let (kinetic, stored) = energy(&world);
        worst = worst.max((kinetic + stored - start).abs());
        most = most.max(kinetic);
    }
    worst / most
}

/// Springs off: a chain that falls and whips. Springs on: released from 0.2 rad a joint.
#[test]
fn an_undamped_hand_keeps_its_energy() {
    for springs in [false, true] {
        let drift = drift(springs, 1e-3);
        assert!(drift <= 1e-3, "springs {springs}: {drift:e}");
    }
}
