//! A hand without dampers keeps its energy.

use crate::dynamics::tree::Kinematics;
use crate::{BaseCommand, Command, Config, Model, State, World};
use palmares_models::hand::Hand;
use palmares_models::{Mat3, Pose, Vec3};
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
    // Slack tendons, whose motors no load slows.
    for motor in &mut hand.motors {
        motor.offset = 10.0;
        (motor.stall_force, motor.power_limit) = (None, None);
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
    config.base.bolted = true;
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

/// Momentum and angular momentum about the world's origin, kg·m/s and kg·m²/s.
fn momenta(world: &World) -> (Vec3, Vec3) {
    let (model, state) = (world.model(), world.state());
    let hand = model.hand().expect("a hand");
    let (mut kin, mut velocity) = (Kinematics::default(), Vec::new());
    kin.update(hand, state.base, &state.q);
    kin.velocities(hand, &state.v[..model.hand_dofs()], &mut velocity);
    hand.links.iter().enumerate().fold((Vec3::ZERO, Vec3::ZERO), |(p, l), (i, link)| {
        let com = kin.pose[i].transform_point(link.inertia.com);
        let share = velocity[i].at(com - kin.origin) * link.inertia.mass;
        let r = Mat3::from_quat(kin.pose[i].rotation);
        let own = r * (link.inertia.about_com * (r.transpose() * velocity[i].angular));
        (p + share, l + com.cross(share) + own)
    })
}

/// Springs released from 0.5 rad a joint while nothing holds the hand: they shake and turn the base.
#[test]
fn an_undamped_hand_in_flight_keeps_energy_and_momentum() {
    for step_s in [1e-3, 8e-3] {
        let model = Model::new(Config::with_step(step_s), Some(undamped(true))).expect("a hand");
        let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
        state.q.fill(0.5);
        state.v[..6].copy_from_slice(&[0.1, -0.2, 1.0, 3.0, -2.0, 1.0]);
        let mass: f64 = model.hand().expect("a hand").links.iter().map(|link| link.inertia.mass).sum();
        let mut world = World::new(Arc::new(model), state);
        let mut command = Command::stay(world.model(), Pose::IDENTITY);
        command.base = BaseCommand::Free;
        let start = energy(&world);
        let (p, l) = momenta(&world);
        let com = |world: &World| {
            let hand = world.model().hand().expect("a hand");
            let mut kin = Kinematics::default();
            kin.update(hand, world.state().base, &world.state().q);
            let weigh = |(i, link): (usize, &palmares_models::hand::Link)| {
                kin.pose[i].transform_point(link.inertia.com) * (link.inertia.mass / mass)
            };
            hand.links.iter().enumerate().map(weigh).fold(Vec3::ZERO, |sum, part| sum + part)
        };
        let before = com(&world);
        for k in 1..=(0.5 / step_s) as u32 {
            assert!(world.step(&command).converged);
            let (time, g) = (f64::from(k) * step_s, world.model().config().gravity);
            let (now_p, now_l) = momenta(&world);
            assert!((now_p - p - g * (mass * time)).length() < 1e-12, "{step_s} {time}: {now_p}");
            // The weight's torque about the origin is that of the falling centre of mass.
            let due = l + (before * time + p * (0.5 * time * time / mass)).cross(g * mass);
            assert!((now_l - due).length() < 1e-8 * l.length(), "{step_s} {time}: {now_l} {due}");
            let fallen = before + p * (time / mass) + g * (0.5 * time * time);
            assert!((com(&world) - fallen).length() < 1e-8, "{step_s} {time}: {}", com(&world));
        }
        let (kinetic, stored) = energy(&world);
        let change = kinetic + stored - start.0 - start.1;
        assert!(change.abs() < 1e-5 * kinetic, "{step_s}: {change:e} J of {kinetic} J");
    }
}

/// The number of substeps belongs to the state: a restored snapshot continues bit for bit.
#[test]
fn an_undamped_hand_goes_on_from_a_snapshot() {
    let mut config = Config::with_step(8e-3);
    config.base.bolted = true;
    let model = Arc::new(Model::new(config, Some(undamped(true))).expect("a hand"));
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    state.q.fill(0.3);
    let mut world = World::new(Arc::clone(&model), state);
    let command = Command::stay(&model, Pose::IDENTITY);
    for _ in 0..20 {
        world.step(&command);
    }
    assert!(world.state().substeps > 1, "springs this stiff need substeps");
    let mut other = World::new(model, world.state().clone());
    for _ in 0..20 {
        world.step(&command);
        other.step(&command);
    }
    assert_eq!(world.state().hash(), other.state().hash());
}

/// Springs off: a chain that falls and whips. Springs on: released from 0.2 rad a joint.
#[test]
fn an_undamped_hand_keeps_its_energy() {
    for (springs, step_s) in [(false, 1e-3), (true, 1e-3), (false, 16e-3)] {
        let drift = drift(springs, step_s);
        assert!(drift <= 1e-5, "springs {springs}: {drift:e}");
    }
}
