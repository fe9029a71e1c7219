//! Dry friction of cables and joints, against closed forms.

use palmares_models::Pose;
use palmares_models::hand::{Guide, Hand};
use palmares_models::read::{LoadOptions, from_text};
use palmares_sim::actuation::friction;
use palmares_sim::statics::band::{Band, band_wound, solve_held};
use palmares_sim::statics::drives::wound_in;
use palmares_sim::{Command, Config, Model, State, World};
use std::path::Path;
use std::sync::Arc;

/// A cable over all joints, with μφ = 0.1, 0.2, 0.3.
const RUBBING: &str = "joints = { a = 1.0, b = 0.8, c = 0.6 }\nrouting = [\"a\", \"b\", \"c\"]\n\
     friction = 0.2\nwrap_angle = { a = 0.5, b = 1.0, c = 1.5 }\n";

/// Steps, s, at which the laws must hold.
const STEPS: [f64; 3] = [0.25e-3, 1e-3, 8e-3];

/// A finger of three joints about z, on a palm; joint k has the stiffness E = 0.3, 0.2, 0.1 N·m/rad.
fn finger(tendon: &str) -> Arc<Hand> {
    let mut urdf = "<robot name='finger'><link name='palm'><inertial><mass value='0.5'/>\
         <inertia ixx='5e-4' ixy='0' ixz='0' iyy='5e-4' iyz='0' izz='5e-4'/></inertial></link>"
        .to_owned();
    for (parent, name) in [("palm", "a"), ("a_link", "b"), ("b_link", "c")] {
        urdf += &format!(
            "<link name='{name}_link'><inertial><origin xyz='0 0.02 0'/><mass value='0.03'/>\
             <inertia ixx='5e-6' ixy='0' ixz='0' iyy='5e-6' iyz='0' izz='5e-6'/></inertial></link>\
             <joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{name}_link'/>\
             <origin xyz='0 0.04 0'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/>\
             <dynamics damping='2e-3'/></joint>"
        );
    }
    let toml = format!(
        "[coordinates]\na.stiffness = 0.3\nb.stiffness = 0.2\nc.stiffness = 0.1\n\
         [motors.m]\nscaling = 1.0\nspeed_limit = 0.5\n[tendons.t]\nmotors = {{ m = 1.0 }}\nstiffness = 20.0\nforce_limit = 50.0\n{tendon}"
    );
    let settings = Some((Path::new("hand.toml"), toml.as_str()));
    let loaded =
        from_text((Path::new("hand.urdf"), &(urdf + "</robot>")), settings, None, &LoadOptions::default());
    Arc::new(loaded.expect("a sound hand").hand)
}

fn world(hand: &Arc<Hand>, h: f64) -> (World, Command) {
    let mut config = Config::with_step(h);
    config.base.bolted = true;
    let model = Arc::new(Model::new(config, Some(hand.clone())).expect("a hand"));
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let command = Command::stay(&model, Pose::IDENTITY);
    (World::new(model, state), command)
}

/// Steps for a time, s, with the motor sent to σ; each must converge.
fn go(world: &mut World, command: &mut Command, sigma: f64, time_s: f64) {
    command.sigma[0] = sigma;
    for _ in 0..(time_s / world.model().config().step_s).round() as usize {
        let outcome = world.step(command);
        assert!(outcome.converged, "{outcome:?}");
    }
}

#[test]
fn tension_falls_by_the_capstan_law_while_the_cable_closes_and_rises_while_it_opens() {
    let hand = finger(RUBBING);
    let exponents = [0.1, 0.2, 0.3];
    for h in STEPS {
        let (mut world, mut command) = world(&hand, h);
        let check = |world: &World, sign: f64| {
            let state = world.state();
            let along = friction::along(&hand, 0, &state.tension, &state.friction);
            // Independently: what springs and dampers pull with.
            let pulled: Vec<f64> = (hand.coordinates.iter().zip(&state.q).zip(&state.v[6..]))
                .map(|((c, q), rate)| c.stiffness * q + c.damping * rate)
                .collect();
            for k in 0..3 {
                let due = libm::exp(-sign * exponents[k]);
                assert!((along[k + 1] / along[k] / due - 1.0).abs() < 1e-3, "{h} {k} {along:?}");
                let arm = hand.tendons[0].moment_arms[k].1;
                assert!((pulled[k] / arm / along[k + 1] - 1.0).abs() < 0.01, "{h} {k} {along:?} {pulled:?}");
            }
        };
        go(&mut world, &mut command, 1.0, 1.5);
        check(&world, 1.0);
        go(&mut world, &mut command, 0.0, 1.0);
        check(&world, -1.0);
    }
}

#[test]
fn a_cable_that_sticks_does_not_creep() {
    let hand = finger(RUBBING);
    for h in [1e-3, 8e-3] {
        let (mut world, mut command) = world(&hand, h);
        go(&mut world, &mut command, 0.6, 2.0);
        // Back by less than what frees the cable.
        go(&mut world, &mut command, 0.59, 1.0);
        let before = world.state().clone();
        go(&mut world, &mut command, 0.59, 60.0);
        let moved = before.q.iter().zip(&world.state().q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 1e-9, "{h} {moved}");
        let loss = (before.tension[0] - world.state().tension[0]).abs();
        assert!(loss < 1e-9, "{h} {loss}");
        // And its rest is the equilibrium with the friction that it has, within the band.
        let state = world.state();
        let s = wound_in(&hand, &state.motors, &state.locked);
        let rest = solve_held(world.model().config(), &hand, Pose::IDENTITY, &s, &[], &state.friction)
            .expect("a rest");
        let off = rest.q.iter().zip(&state.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-7, "{h} {off}");
        let Band { closing, opening } =
            band_wound(world.model().config(), &hand, Pose::IDENTITY, &s, &[]).expect("limits");
        assert!((opening.tension[0]..=closing.tension[0]).contains(&state.tension[0]));
    }
}

#[test]
fn a_world_that_rubs_goes_on_from_a_snapshot() {
    let (mut one, mut command) = world(&finger(RUBBING), 1e-3);
    go(&mut one, &mut command, 0.6, 1.0);
    let (snapshot, before) = (one.snapshot(), one.state().hash());
    assert!(snapshot.fits(one.model()));
    go(&mut one, &mut command, 0.2, 1.0);
    let end = one.state().hash();
    let (mut other, _) = world(&finger(RUBBING), 1e-3);
    other.resume(&snapshot);
    assert_eq!(other.state().hash(), before);
    go(&mut other, &mut command, 0.2, 1.0);
    assert_eq!(other.state().hash(), end);
    let plain = world(&finger("joints = { a = 1.0 }\n"), 1e-3).0;
    assert!(!snapshot.fits(plain.model()), "a hand without friction has no forces of friction");
}

#[test]
fn joints_with_dry_friction_stop_and_stay() {
    let mut hand = Hand::clone(&finger("joints = { a = 1.0, b = 0.8, c = 0.6 }\n"));
    for c in &mut hand.coordinates {
        (c.friction, c.damping) = (0.01, 0.0);
    }
    let hand = Arc::new(hand);
    for h in STEPS {
        let (mut world, mut command) = world(&hand, h);
        world.state_mut().q.copy_from_slice(&[0.5, -0.4, 0.3]);
        go(&mut world, &mut command, 0.0, 3.0);
        let state = world.state();
        assert!(state.v.iter().all(|v| v.abs() < 1e-6), "{h} {:?}", state.v);
        assert!(
            hand.coordinates.iter().zip(&state.q).all(|(c, q)| (c.stiffness * q).abs() <= 0.0101),
            "{h} {:?}",
            state.q
        );
    }
}

/// A SoftHand whose cable and joints rub everywhere, closed and opened by jumps: every step converges.
#[test]
fn a_softhand_that_rubs_survives_jumps() {
    let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
    let order = hand.tendons[0].coordinates();
    let guide = |coordinate| Guide::new(coordinate, 0.1, 1.0);
    hand.tendons[0].guides = order.into_iter().map(guide).collect();
    hand.coordinates.iter_mut().for_each(|c| c.friction = 1e-3);
    let hand = Arc::new(hand);
    for h in STEPS {
        let (mut world, mut command) = world(&hand, h);
        for sigma in [1.0, 0.3, 0.5, 0.0, 0.9, 0.85] {
            go(&mut world, &mut command, sigma, 0.6);
        }
        assert_eq!(world.fault(), None);
    }
}
