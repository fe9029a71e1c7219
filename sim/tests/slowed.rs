//! Motors that a load slows: a line, a limit of power, an effort. One joint and one tendon have closed forms; hands have bounds.

use palmares_models::Pose;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_models::read::{LoadOptions, from_text};
use palmares_sim::{Command, Config, Model, Push, State, World};
use std::path::Path;
use std::sync::Arc;

/// Integration steps, s.
const STEPS: [f64; 6] = [2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3];
/// Moment arm 1: the tendon's force is the joint's torque.
const SCALING: f64 = 2.0;
const STALL: f64 = 1.2;
const SPEED: f64 = 1.5;

/// A bar of negligible inertia on one hinge, with a motor and a tendon.
fn bar(spring: f64, damping: f64, upper: f64, motor: &str, tendon: &str) -> Arc<Hand> {
    let urdf = format!(
        "<robot name='bar'><link name='palm'><inertial><mass value='0.5'/>\
         <inertia ixx='5e-4' ixy='0' ixz='0' iyy='5e-4' iyz='0' izz='5e-4'/></inertial></link>\
         <link name='bar'><inertial><origin xyz='0 0 0'/><mass value='0.01'/>\
         <inertia ixx='1e-7' ixy='0' ixz='0' iyy='1e-7' iyz='0' izz='1e-7'/></inertial></link>\
         <joint name='j' type='revolute'><parent link='palm'/><child link='bar'/><axis xyz='0 0 1'/>\
         <limit lower='-0.5' upper='{upper}' effort='1' velocity='1'/><dynamics damping='{damping}'/></joint></robot>"
    );
    let toml = format!(
        "[motors.m]\nscaling = {SCALING}\nspeed_limit = {SPEED}\n{motor}\n\
         [tendons.t]\nmotors.m = 1\njoints.j = 1\nstiffness = 300\nforce_limit = {STALL}\n{tendon}\n\
         [coordinates]\nj.stiffness = {spring}\n"
    );
    let settings = Some((Path::new("hand.toml"), toml.as_str()));
    let loaded = from_text((Path::new("hand.urdf"), &urdf), settings, None, &LoadOptions::default());
    Arc::new(loaded.expect("a sound hand").hand)
}

/// The hand with a bolted base, and the command to close it.
fn closing(hand: &Arc<Hand>, h: f64) -> (World, Command) {
    let mut config = Config::with_step(h);
    config.base.bolted = true;
    let model = Arc::new(Model::new(config, Some(Arc::clone(hand))).expect("a sound model"));
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut command = Command::stay(&model, Pose::IDENTITY);
    command.sigma.fill(1.0);
    (World::new(model, state), command)
}

fn line() -> String {
    format!("stall_force = {STALL}")
}

#[test]
fn a_blocked_motor_reaches_its_stall_force_without_oscillation() {
    for h in STEPS {
        let (mut world, command) = closing(&bar(0.0, 0.01, 0.2, &line(), ""), h);
        let (mut last, mut most) = (0.0, 0.0_f64);
        for k in 0..(1.0 / h) as usize {
            assert!(world.step(&command).converged, "{h} {k}");
            let f = world.state().tension[0];
            let blocked = world.state().q[0] > 0.2;
            assert!(!blocked || f >= last - 1e-9, "{h} {k}: {f} after {last}");
            last = if blocked { f } else { 0.0 };
            most = most.max(f);
        }
        assert!((last - STALL).abs() < 1e-9 && most < STALL + 1e-9, "{h}: {last} {most}");
        let motor = world.state().motors[0];
        let ahead = SCALING * motor.position - world.state().q[0];
        assert!((ahead - STALL / 300.0).abs() < 1e-9, "{h}: the motor stops with its tendon: {motor:?}");
    }
}

#[test]
fn its_speed_falls_with_the_load_on_a_line() {
    for h in STEPS {
        // A slack tendon is no load.
        let (mut world, command) = closing(&bar(0.0, 0.0, 3.0, &line(), ""), h);
        world.state_mut().q[0] = 2.5;
        let steps = (0.4 / h) as usize;
        (0..steps).for_each(|_| assert!(world.step(&command).converged));
        let free = world.state().motors[0].position;
        assert!((free - SPEED * h * steps as f64).abs() < 1e-12, "{h}: {free}");
        // A damper b: F = b ds/dt, so that dσ/dt = v₀ / (1 + b c v₀ / F₀).
        let damping = 0.3;
        let (mut world, command) = closing(&bar(0.0, damping, 3.0, &line(), ""), h);
        (0..steps).for_each(|_| assert!(world.step(&command).converged));
        let exact = SPEED / (1.0 + damping * SCALING * SPEED / STALL);
        let reached = world.state().motors[0].velocity;
        assert!((reached / exact - 1.0).abs() < 1e-6, "{h}: {reached} for {exact}");
    }
}

#[test]
fn it_winds_a_spring_along_an_exponential() {
    let (spring, end) = (0.6, 0.5);
    for h in STEPS {
        let (mut world, command) = closing(&bar(spring, 1e-4, 3.0, &line(), ""), h);
        let mut worst = 0.0_f64;
        for k in 1..=(end / h) as usize {
            world.step(&command);
            // Tendon and spring in series: F = k c σ.
            let stiffness = 1.0 / (1.0 / spring + 1.0 / 300.0);
            let rate = stiffness * SCALING * SPEED / STALL;
            let exact = SPEED / rate * (1.0 - libm::exp(-rate * h * k as f64));
            worst = worst.max((world.state().motors[0].position - exact).abs());
        }
        assert!(worst < 0.01 * SPEED * end, "{h}: {worst}");
    }
}

#[test]
fn the_power_never_exceeds_its_limit() {
    for name in ["softhand", "reflex"] {
        let mut hand = Hand::clone(&Hand::builtin(name).expect("it is built in"));
        for motor in &mut hand.motors {
            motor.power_limit = Some(2.0);
            motor.stall_force = Some(1.4);
        }
        let hand = Arc::new(hand);
        for h in [1e-3, 8e-3] {
            let (mut world, command) = closing(&hand, h);
            let mut most = 0.0_f64;
            for _ in 0..(1.5 / h) as usize {
                world.step(&command);
                most = world.motor_power().fold(most, f64::max);
                assert!(world.state().tension.iter().all(|f| *f <= 1.4 + 1e-9));
            }
            assert!(most > 0.5 && most < 2.02, "{name} {h}: {most}");
        }
    }
}

#[test]
fn the_effort_limits_the_tension_at_rest() {
    for motor in [String::new(), line()] {
        for h in [1e-3, 8e-3] {
            let (mut world, mut command) = closing(&bar(0.0, 0.01, 0.2, &motor, ""), h);
            for (effort, force) in [(0.25, 0.25), (1.0, 1.0), (0.5, 0.5), (0.0, 0.0)] {
                command.effort = vec![effort];
                (0..(0.5 / h) as usize).for_each(|_| assert!(world.step(&command).converged));
                let f = world.state().tension[0];
                assert!((f - force * STALL).abs() < 1e-9, "{motor} {h} {effort}: {f}");
            }
            // A motor keeps its effort until another is commanded.
            command.effort.clear();
            world.step(&command);
            assert_eq!(world.state().motors[0].effort, 0.0);
        }
    }
}

#[test]
fn a_load_turns_a_motor_back_unless_its_gear_holds() {
    for (gear, held) in [("", false), ("hold_limit = 6", true)] {
        for h in [1e-3, 8e-3] {
            let hand = bar(1e-3, 0.05, 3.0, &line(), gear);
            let (mut world, mut command) = closing(&hand, h);
            command.sigma = vec![0.6];
            (0..(1.0 / h) as usize).for_each(|_| assert!(world.step(&command).converged));
            let at = world.state().motors[0].position;
            assert!((at - 0.6).abs() < 1e-9, "{gear} {h}: {at}");
            // Twice the stall torque, about the hinge.
            let link = hand.links.iter().position(|link| link.name == "bar").expect("there");
            let arm = 0.1;
            let q = world.state().q[0];
            let force = Vec3::new(0.0, -2.0 * STALL / arm, 0.0);
            let point = Vec3::new(arm * libm::cos(q), -arm * libm::sin(q), 0.0);
            command.pushes = vec![Push { link, point, force }];
            (0..(0.05 / h) as usize).for_each(|_| assert!(world.step(&command).converged));
            let (back, f) = (world.state().motors[0].position, world.state().tension[0]);
            assert_eq!(back == at, held, "{gear} {h}: {at} {back}");
            assert!(held && f > 1.5 * STALL || !held && (f - STALL).abs() < 1e-9, "{gear} {h}: {f}");
        }
    }
}
