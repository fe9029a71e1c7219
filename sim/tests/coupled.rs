//! Hands whose joints are coupled: motors that share tendons, springs across joints, passive tendons, tendons of any path, closed
//! chains. Each is compared with a closed form, or with the exact equilibrium of its lengths.

use palmares_models::hand::Hand;
use palmares_models::read::{LoadOptions, from_text};
use palmares_models::{Pose, Vec3};
use palmares_sim::actuation::elastic;
use palmares_sim::statics::constrained::solve_constrained;
use palmares_sim::statics::equilibrium::{ClosedForm, NoClosedForm};
use palmares_sim::statics::prediction::{solve_loaded, solve_wound};
use palmares_sim::statics::rest::{Equilibrium, Method, NoPrediction};
use palmares_sim::{Command, Config, Model, Push, State, World};
use std::path::Path;
use std::sync::Arc;

/// A palm, and bars behind hinges about z: (name, parent, position in the parent's frame, tip in the own frame).
fn urdf(bars: &[(&str, &str, [f64; 2], [f64; 2])]) -> String {
    let inertial = |[x, y]: [f64; 2]| {
        format!(
            "<inertial><origin xyz='{} {} 0'/><mass value='0.03'/>\
             <inertia ixx='5e-6' ixy='0' ixz='0' iyy='5e-6' iyz='0' izz='5e-6'/></inertial>",
            0.5 * x,
            0.5 * y
        )
    };
    let mut out = "<robot name='coupled'><link name='palm'><inertial><mass value='0.5'/>\
                   <inertia ixx='5e-4' ixy='0' ixz='0' iyy='5e-4' iyz='0' izz='5e-4'/></inertial></link>"
        .to_owned();
    for (name, parent, [x, y], tip) in bars {
        out += &format!(
            "<link name='{name}_link'>{}</link><joint name='{name}' type='revolute'><parent link='{parent}'/>\
             <child link='{name}_link'/><origin xyz='{x} {y} 0'/><axis xyz='0 0 1'/>\
             <limit lower='-3' upper='3' effort='1' velocity='1'/><dynamics damping='0.02'/></joint>",
            inertial(*tip)
        );
    }
    out + "</robot>"
}

fn hand(urdf: &str, toml: &str) -> Arc<Hand> {
    let settings = Some((Path::new("hand.toml"), toml));
    let loaded = from_text((Path::new("hand.urdf"), urdf), settings, None, &LoadOptions::default());
    Arc::new(loaded.expect("a sound hand").hand)
}

/// Two fingers of two joints.
fn fingers(toml: &str) -> Arc<Hand> {
    let finger = [0.0, 0.05];
    let bars = [
        ("a", "palm", [-0.03, 0.0], finger),
        ("b", "a_link", finger, finger),
        ("c", "palm", [0.03, 0.0], finger),
        ("d", "c_link", finger, finger),
    ];
    let springs = "[coordinates]\na.stiffness = 0.2\nb.stiffness = 0.3\nc.stiffness = 0.25\nd.stiffness = 0.4\nb.rest = 0.1\n";
    hand(&urdf(&bars), &format!("{springs}{toml}"))
}

/// A four-bar: crank, coupler, and rocker, closed at the end of the coupler.
fn four_bar(toml: &str) -> Arc<Hand> {
    let bars = [
        ("crank", "palm", [0.0, 0.0], [0.0, 0.03]),
        ("coupler", "crank_link", [0.0, 0.03], [0.04, 0.01]),
        ("rocker", "palm", [0.04, 0.0], [0.0, 0.04]),
    ];
    let toml = format!(
        "[motors.m]\nscaling = 1.2\noffset = 0.5\nspeed_limit = 1\n[tendons.drive]\njoints.crank = 1\nmotors.m = 1\n\
         both_ways = true\nstiffness = 40\nforce_limit = 5\n[linkages.pin]\nlinks = ['coupler_link', 'rocker_link']\n\
         points = [[0.04, 0.01, 0], [0, 0.04, 0]]\nstiffness = 1e7\n{toml}"
    );
    hand(&urdf(&bars), &toml)
}

/// The angle of the four-bar's rocker at an angle of the crank, with rigid bars and pins: the intersection of two circles.
fn rocker_angle(crank: f64) -> f64 {
    let (coupler, rocker) = (0.04_f64.hypot(0.01), 0.04);
    let (px, py) = (-0.03 * crank.sin(), 0.03 * crank.cos());
    let (dx, dy) = (0.04 - px, -py);
    let d = dx.hypot(dy);
    let along = (coupler * coupler - rocker * rocker + d * d) / (2.0 * d);
    let across = (coupler * coupler - along * along).sqrt();
    let (x, y) = (px + (along * dx - across * dy) / d, py + (along * dy + across * dx) / d);
    (-(x - 0.04)).atan2(y)
}

/// The usual constants with a fine tolerance: at rest, forces balance to 1e-7 of their size with the usual one.
fn fine() -> Config {
    Config { tolerance: 1e-11, ..Config::default() }
}

/// Simulates until nothing moves.
fn rest(hand: &Arc<Hand>, sigma: &[f64], pushes: &[Push]) -> World {
    let model = Arc::new(Model::new(fine(), Some(Arc::clone(hand))).expect("a sound model"));
    let mut command = Command::stay(&model, Pose::IDENTITY);
    command.sigma = sigma.to_vec();
    command.pushes = pushes.to_vec();
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut world = World::new(model, state);
    for _ in 0..20_000 {
        assert!(world.step(&command).converged);
        if world.state().step > 2000 && world.state().v.iter().all(|v| v.abs() < 1e-10) {
            return world;
        }
    }
    panic!("{:?} still moves: {:?}", hand.name, world.state().v);
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Compares a hand at rest with its prediction, without and with a push; the base yields to a push, so that only torques on joints are
/// compared then.
fn agrees(hand: &Arc<Hand>, sigma: &[f64]) -> Equilibrium {
    let predicted = solve_loaded(&Config::default(), hand, Pose::IDENTITY, sigma, &[]).expect("a rest");
    let world = rest(hand, sigma, &[]);
    assert!(largest(&world.state().q, &predicted.q) < 1e-9, "{:?} {:?}", world.state().q, predicted.q);
    assert!(largest(&world.state().tension, &predicted.tension) < 1e-7, "{:?}", predicted.tension);
    assert!(world.joint_residual().iter().all(|torque| torque.abs() < 1e-9), "{:?}", world.joint_residual());
    let push = Push {
        link: hand.links.len() - 1,
        point: Vec3::new(0.0, 0.02, 0.0),
        force: Vec3::new(0.4, -0.1, 0.0),
    };
    let pushed = rest(hand, sigma, &[push]);
    assert!(
        pushed.joint_residual().iter().zip(push_torques(&pushed, push)).all(|(a, b)| (a + b).abs() < 1e-9)
    );
    let predicted_pushed =
        solve_loaded(&Config::default(), hand, pushed.state().base, sigma, &[push]).expect("a rest");
    assert!(largest(&pushed.state().q, &predicted_pushed.q) < 1e-8, "{:?}", predicted_pushed.q);
    predicted
}

fn push_torques(world: &World, push: Push) -> Vec<f64> {
    let hand = world.model().hand().expect("a hand");
    let state = world.state();
    palmares_sim::statics::loads::torques(world.model().config(), hand, state.base, &state.q, &[push])
}

#[test]
fn two_motors_pull_by_sum_and_difference() {
    // One cable from motor to motor: its mean winding closes both fingers, its slip bends one and opens the other.
    let hand = fingers(
        "[motors.left]\nscaling = 0.02\nspeed_limit = 2\n[motors.right]\nscaling = 0.02\nspeed_limit = 2\n\
         [tendons.close]\nmotors = { left = 0.5, right = 0.5 }\njoints = { a = 0.008, b = 0.006, c = 0.008, d = 0.006 }\n\
         stiffness = 2e4\nforce_limit = 200\n\
         [tendons.slide]\nmotors = { left = 0.5, right = -0.5 }\njoints = { a = 0.004, c = -0.004 }\nboth_ways = true\n\
         stiffness = 2e4\nforce_limit = 200\n",
    );
    assert_eq!(hand.tendons[1].motors, [(0, 0.5), (1, -0.5)]);
    let predicted = agrees(&hand, &[0.9, 0.5]);
    assert_eq!(predicted.method, Method::ClosedForm);
    // With rigid cables R q = s; these give way by f/K.
    for (tendon, (s, f)) in hand.tendons.iter().zip([0.5 * 0.028, 0.5 * 0.008].iter().zip(&predicted.tension))
    {
        assert!((tendon.length(&predicted.q) + f / tendon.stiffness - s).abs() < 1e-14);
    }
    // The motors share the tensions by their weights.
    let [sum, difference] = [predicted.tension[0], predicted.tension[1]];
    assert!((hand.motor_load(0, &predicted.tension) - 0.5 * (sum + difference)).abs() < 1e-15);
    assert!((hand.motor_load(1, &predicted.tension) - 0.5 * (sum - difference)).abs() < 1e-15);
}

#[test]
fn a_spring_across_joints_is_the_part_of_e_off_its_diagonal() {
    let drive = "[motors.m]\nscaling = 0.02\nspeed_limit = 2\n[tendons.t]\nmotors.m = 1\njoints = { a = 0.01, b = 0.005 }\n\
                 stiffness = 1e4\nforce_limit = 100\n";
    let coupled = "[springs.belt]\njoints = { a = 1, c = -1 }\nstiffness = 0.5\nrest = 0.05\n\
                   [springs.ligament]\njoints = { c = 0.6, d = 0.3 }\nstiffness = 0.7\ndamping = 0.01\n";
    let hand = fingers(&format!("{drive}{coupled}"));
    let form = ClosedForm::new(&hand).expect("it has one");
    let e = form.compliance.clone().try_inverse().expect("it is regular");
    let by_hand = [
        [0.2 + 0.5, 0.0, -0.5, 0.0],
        [0.0, 0.3, 0.0, 0.0],
        [-0.5, 0.0, 0.25 + 0.5 + 0.7 * 0.36, 0.7 * 0.18],
        [0.0, 0.0, 0.7 * 0.18, 0.4 + 0.7 * 0.09],
    ];
    for (i, row) in by_hand.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            assert!((e[(i, j)] - entry).abs() < 1e-12, "{i} {j}: {} {entry}", e[(i, j)]);
        }
    }
    let predicted = agrees(&hand, &[0.7]);
    assert_eq!(predicted.method, Method::ClosedForm);
    // The finger without a tendon follows through the spring.
    assert!(predicted.q[2] > 0.1, "{:?}", predicted.q);
}

#[test]
fn a_tendon_without_a_motor_has_a_fixed_length() {
    // A passive cable couples the joints of a finger: when one bends, it pulls the other.
    let hand = fingers(
        "[motors.m]\nscaling = 0.8\nspeed_limit = 2\n[tendons.servo]\nmotors.m = 1\njoints.a = 1\nboth_ways = true\n\
         stiffness = 40\nforce_limit = 3\n\
         [tendons.passive]\nmotors = {}\nrest = 1e-4\njoints = { a = -0.01, b = 0.012 }\nstiffness = 2e4\nforce_limit = 60\n",
    );
    assert!(hand.tendons[0].motors.is_empty() && hand.tendons[0].rest == 1e-4);
    let predicted = agrees(&hand, &[1.0]);
    assert!(predicted.tension[0] > 1.0 && predicted.q[1] > 0.5, "{predicted:?}");
    let back = agrees(&hand, &[0.0]);
    assert!(back.tension[0] < predicted.tension[0]);
}

#[test]
fn a_tendon_may_have_any_smooth_length() {
    let hand = fingers(
        "[motors.m]\nscaling = 0.02\nspeed_limit = 2\n[tendons.t]\nmotors.m = 1\nstiffness = 2e4\nforce_limit = 60\n\
         polynomial.a.coefficients = [0.01, -0.002, 0.0005]\n\
         table.b = { at = [-0.5, 0, 0.5, 1, 1.5], length = [-0.004, 0, 0.0045, 0.0098, 0.0159] }\n\
         eyelets.c = { before = [-0.012, 0.006], after = [0.02, 0.004] }\n",
    );
    let predicted = agrees(&hand, &[0.8]);
    assert!(matches!(ClosedForm::new(&hand), Err(NoClosedForm::VaryingArms { .. })));
    assert!(predicted.q[..3].iter().all(|q| q.abs() > 0.02), "{predicted:?}");
}

#[test]
fn a_closed_four_bar_moves_by_its_geometry() {
    let hand = four_bar("");
    let rows = elastic::rows(&hand);
    assert_eq!(rows, 1 + 3);
    for sigma in [0.2, 0.5, 0.8, 1.0] {
        let world = rest(&hand, &[sigma], &[]);
        let q = &world.state().q;
        assert!((q[0] - (1.2 * (sigma - 0.5))).abs() < 1e-9, "nothing resists the crank: {q:?}");
        assert!((q[2] - rocker_angle(q[0])).abs() < 1e-9, "{q:?} {}", rocker_angle(q[0]));
    }
}

#[test]
fn a_closed_four_bar_rests_where_its_energy_is_least() {
    let hand = four_bar("[coordinates]\nrocker.stiffness = 0.3\nrocker.rest = 0.4\n");
    assert!(matches!(ClosedForm::new(&hand), Err(NoClosedForm::ClosedChain { .. })));
    for sigma in [0.1, 0.7] {
        let predicted = agrees(&hand, &[sigma]);
        assert_eq!(predicted.method, Method::Newton);
        // Virtual work: the crank's torque is the rocker's by the ratio of their speeds.
        let h = 1e-6;
        let ratio = (rocker_angle(predicted.q[0] + h) - rocker_angle(predicted.q[0] - h)) / (2.0 * h);
        let spring = 0.3 * (predicted.q[2] - 0.4);
        assert!((predicted.tension[0] - spring * ratio).abs() < 2e-5, "{predicted:?}");
        let held =
            solve_constrained(&Config::default(), &hand, Pose::IDENTITY, &[sigma], &[], &[]).expect("a rest");
        assert!(largest(&held.equilibrium.q, &predicted.q) < 1e-7);
    }
}

/// While it moves, the pin stays closed, and an undamped chain keeps its energy within the loss of the method.
#[test]
fn a_pin_stays_closed_in_motion() {
    let hand = four_bar("[coordinates]\nrocker.stiffness = 0.3\nrocker.rest = 0.4\n");
    let model = Arc::new(Model::new(Config::default(), Some(Arc::clone(&hand))).expect("a sound model"));
    let mut command = Command::stay(&model, Pose::IDENTITY);
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    state.motors[0].position = 0.5;
    let mut world = World::new(model, state);
    let mut most: f64 = 0.0;
    for k in 0..4000 {
        command.sigma = vec![if k / 200 % 2 == 0 { 1.0 } else { 0.0 }];
        assert!(world.step(&command).converged);
        let q = &world.state().q;
        most = most.max(hand.linkages[0].at(&hand, q).gap.length());
    }
    assert!(most < 1e-5, "the pin opens by {most} m");
}

#[test]
fn joints_that_only_a_pin_could_hold_are_loose_without_it() {
    let hand = four_bar("");
    let mut open = Hand::clone(&hand);
    open.linkages.clear();
    let at = |hand: &Hand| solve_loaded(&Config::default(), hand, Pose::IDENTITY, &[0.6], &[]);
    assert!(at(&hand).is_ok());
    assert!(matches!(at(&open), Err(NoPrediction::Loose(joint)) if joint == "coupler"));
    // A belt between two joints without springs leaves both loose.
    let mut belt = Hand::clone(&hand);
    belt.linkages.clear();
    belt.springs.push(palmares_models::hand::Spring {
        name: "belt".into(),
        arms: vec![(1, 1.0), (2, -1.0)],
        numbers: palmares_models::hand::SpringNumbers { stiffness: 1.0, damping: 0.0, rest: 0.0 },
    });
    assert!(matches!(at(&belt), Err(NoPrediction::Loose(_))));
}

/// A finger of two joints against a fixed obstacle is replaced by a push that grows: the drive of the inner joint reaches its limit.
fn driven_finger(drive: &str) -> Arc<Hand> {
    // As the Barrett hand: q2 + q3 = θ/93.75, q2 = θ/125, of one motor at θ; here θ in units of 125.
    fingers(&format!(
        "[motors.m]\nscaling = 1.2\nspeed_limit = 1\n\
         [tendons.inner]\nmotors.m = 1\njoints.a = 1\nboth_ways = true\nstiffness = 50\n{drive}\
         [tendons.sum]\nmotors.m = 1.3333333333333333\njoints = {{ a = 1, b = 1 }}\nboth_ways = true\nstiffness = 50\nforce_limit = 5\n"
    ))
}

fn run(world: &mut World, command: &Command, steps: usize) {
    for _ in 0..steps {
        assert!(world.step(command).converged);
    }
}

#[test]
fn a_clutch_lets_go_and_the_motor_goes_on() {
    let hand = driven_finger("force_limit = 0.5\nhold_limit = 4\nbreakaway = true\n");
    let model = Arc::new(Model::new(fine(), Some(Arc::clone(&hand))).expect("a sound model"));
    let mut command = Command::stay(&model, Pose::IDENTITY);
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    // At its spring's rest, b would pull the drives on at once.
    state.q.fill(0.0);
    let mut world = World::new(model, state);
    command.sigma = vec![0.4];
    run(&mut world, &command, 1500);
    let ratio = world.state().q[1] / world.state().q[0];
    // Springs of the joints bend the drives a little.
    assert!((ratio - 1.0 / 3.0).abs() < 0.02, "the outer joint follows with a third: {ratio}");
    assert_eq!(world.state().locked, [None]);
    // A load on the inner joint: the clutch lets go, and the outer joint closes with the whole motor.
    let link = hand
        .coordinate("a")
        .map(|c| hand.links.iter().position(|l| l.joint.as_ref().is_some_and(|j| j.coordinate == c)));
    let link = link.flatten().expect("the inner link");
    command.pushes = vec![Push { link, point: Vec3::new(0.0, 0.05, 0.0), force: Vec3::new(16.0, 0.0, 0.0) }];
    command.sigma = vec![0.9];
    run(&mut world, &command, 1500);
    let [inner, outer] = [world.state().q[0], world.state().q[1]];
    let at = world.state().locked[0].expect("it let go");
    assert!((0.48..0.7).contains(&at), "{at}");
    assert!((inner - at).abs() < 0.03, "locked where it let go: {inner} {at}");
    assert!((inner + outer - 1.2 * 0.9 * 4.0 / 3.0).abs() < 0.05, "{inner} {outer}");
    // Without the load it stays: the worm holds it, also against its spring.
    command.pushes.clear();
    run(&mut world, &command, 1500);
    assert!((world.state().q[0] - at).abs() < 0.01);
    // The motor comes back, takes the inner link along, and opens the finger.
    command.sigma = vec![0.0];
    run(&mut world, &command, 3000);
    assert_eq!(world.state().locked, [None]);
    assert!(world.state().q[0].abs() < 0.01, "{:?}", world.state().q);
}

#[test]
fn a_worm_stops_at_its_limit_and_holds_what_it_could_not_move() {
    let hand = driven_finger("force_limit = 0.5\nhold_limit = 4\n");
    let model = Arc::new(Model::new(fine(), Some(Arc::clone(&hand))).expect("a sound model"));
    let mut command = Command::stay(&model, Pose::IDENTITY);
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    // At its spring's rest, b would pull the drives on at once.
    state.q.fill(0.0);
    let mut world = World::new(model, state);
    let inner = hand.coordinate("a").expect("there");
    let link = hand
        .links
        .iter()
        .position(|l| l.joint.as_ref().is_some_and(|j| j.coordinate == inner))
        .expect("there");
    command.pushes = vec![Push { link, point: Vec3::new(0.0, 0.05, 0.0), force: Vec3::new(12.0, 0.0, 0.0) }];
    command.sigma = vec![0.9];
    run(&mut world, &command, 3000);
    let stalled = world.state().motors[0].position;
    assert!(stalled < 0.1, "the motor stopped: {stalled}");
    let before = world.state().q[0];
    let tension = world.state().tension[0];
    // It holds the load of 0.6 N·m and the spring of the outer joint.
    assert!((0.6..0.65).contains(&tension), "{tension}");
    // A load five times its largest force does not turn it back.
    command.pushes[0].force.x = 60.0;
    run(&mut world, &command, 2000);
    assert!(world.state().tension[0] > 1.5, "{:?}", world.state().tension);
    assert!((world.state().q[0] - before).abs() < 0.06, "{before} {:?}", world.state().q);
}

/// One joint with a spring of 0.2 N·m/rad on a pulley of 10 mm, whose motor pulls with at most 10 N: it can bend it by 0.5 rad.
fn worm_finger(speed: f64, drive: &str) -> Arc<Hand> {
    fingers(&format!(
        "[motors.m]\nscaling = 0.02\nspeed_limit = {speed}\n\
         [tendons.t]\nmotors.m = 1\njoints.a = 0.01\nstiffness = 2e4\nforce_limit = 10\nhold_limit = 60\n{drive}"
    ))
}

#[test]
fn a_motor_pulls_with_its_largest_force_and_no_more_at_any_speed() {
    for drive in ["", "breakaway = true\n"] {
        for speed in [0.02, 0.2, 1.0, 5.0] {
            let hand = worm_finger(speed, drive);
            let predicted =
                solve_loaded(&Config::default(), &hand, Pose::IDENTITY, &[0.8], &[]).expect("a rest");
            assert!((predicted.tension[0] - 10.0).abs() < 1e-6, "{predicted:?}");
            assert!((predicted.q[hand.coordinate("a").expect("there")] - 0.5).abs() < 1e-6, "{predicted:?}");
            // Below its largest force it goes where it should: s = R q + f/K.
            let near = solve_loaded(&Config::default(), &hand, Pose::IDENTITY, &[0.1], &[]).expect("a rest");
            let stiffness = 1.0 / (0.01 * 0.01 / 0.2 + 1.0 / 2e4);
            assert!((near.tension[0] - 0.002 * stiffness).abs() < 1e-9, "{near:?}");
            let simulated = rest(&hand, &[0.8], &[]);
            let state = simulated.state();
            if drive.is_empty() {
                assert!((state.tension[0] - 10.0).abs() < 1e-6, "{speed}: {:?}", state.tension);
                assert!(state.motors[0].velocity.abs() < 1e-9 && state.motors[0].position < 0.8);
            } else {
                // Damping and inertia took a part of the force at which it let go.
                let least = if speed < 0.1 { 9.85 } else { 0.0 };
                assert!((least..=10.0).contains(&state.tension[0]), "{speed}: {:?}", state.tension);
                assert!(state.locked[0].is_some());
            }
            let wound = palmares_sim::statics::drives::wound_in(&hand, &state.motors, &state.locked);
            let again =
                solve_wound(simulated.model().config(), &hand, state.base, &wound, &[]).expect("a rest");
            assert!((again.tension[0] - state.tension[0]).abs() < 1e-6, "{again:?} {:?}", state.tension);
        }
    }
}

#[test]
fn what_holds_more_than_it_pulls_is_pushed_back_only_by_its_own_compliance() {
    let hand = worm_finger(1.0, "");
    let a = hand.coordinate("a").expect("there");
    let link =
        hand.links.iter().position(|l| l.joint.as_ref().is_some_and(|j| j.coordinate == a)).expect("there");
    let push = Push { link, point: Vec3::new(0.0, 0.05, 0.0), force: Vec3::new(4.0, 0.0, 0.0) };
    let at = |pushes: &[Push]| {
        solve_loaded(&Config::default(), &hand, Pose::IDENTITY, &[0.8], pushes).expect("a rest")
    };
    let (free, pushed) = (at(&[]), at(&[push]));
    let more = pushed.tension[0] - free.tension[0];
    // s_ref stays: the tendon gives by its own elasticity.
    assert!(more.abs() > 1.0, "{free:?} {pushed:?}");
    assert!((0.01 * (free.q[a] - pushed.q[a]) - more / 2e4).abs() < 1e-12, "{free:?} {pushed:?}");
}

#[test]
fn a_clutch_is_part_of_the_state() {
    let hand = driven_finger("force_limit = 0.5\nhold_limit = 4\nbreakaway = true\n");
    let model = Arc::new(Model::new(Config::default(), Some(Arc::clone(&hand))).expect("a sound model"));
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut other = state.clone();
    other.locked = vec![Some(0.2)];
    assert_ne!(state.hash(), other.hash());
}

/// A flexure that bends about two axes: two joints, a link without mass between them, and a matrix of stiffness.
#[test]
fn a_flexure_of_two_axes_has_a_matrix_of_stiffness() {
    let limits = "<limit lower='-1' upper='1' effort='1' velocity='1'/><dynamics damping='0.02'/>";
    let body = "<inertial><origin xyz='0 0.03 0'/><mass value='0.05'/>\
                <inertia ixx='2e-5' ixy='0' ixz='0' iyy='5e-6' iyz='0' izz='2e-5'/></inertial>";
    let urdf = format!(
        "<robot name='flexure'><link name='palm'><inertial><mass value='0.5'/>\
         <inertia ixx='5e-4' ixy='0' ixz='0' iyy='5e-4' iyz='0' izz='5e-4'/></inertial></link><link name='between'/>\
         <link name='tip'>{body}</link>\
         <joint name='bend' type='revolute'><parent link='palm'/><child link='between'/><axis xyz='0 0 1'/>{limits}</joint>\
         <joint name='tilt' type='revolute'><parent link='between'/><child link='tip'/><axis xyz='1 0 0'/>{limits}</joint></robot>"
    );
    // [[0.5, 0.1], [0.1, 0.3]] N m/rad.
    let toml = "[coordinates]\nbend.stiffness = 0.4\ntilt.stiffness = 0.2\n\
                [springs.coupling]\njoints = { bend = 1, tilt = 1 }\nstiffness = 0.1\n";
    let hand = hand(&urdf, toml);
    let mass: f64 = hand.links[1..].iter().map(|link| link.inertia.mass).sum();
    assert!((mass - 0.05).abs() < 1e-15 && (hand.links[1].inertia.mass - 0.001).abs() < 1e-15);
    let push = Push { link: 2, point: Vec3::new(0.0, 0.06, 0.0), force: Vec3::new(-0.5, 0.0, 0.4) };
    let world = rest(&hand, &[], &[push]);
    let [bend, tilt] = [world.state().q[0], world.state().q[1]];
    let torques = push_torques(&world, push);
    assert!((0.5 * bend + 0.1 * tilt - torques[0]).abs() < 1e-9, "{bend} {tilt} {torques:?}");
    assert!((0.1 * bend + 0.3 * tilt - torques[1]).abs() < 1e-9, "{bend} {tilt} {torques:?}");
}

/// Stiff antagonists with a low limit: guesses which of them are taut, slack or at their limit lead in a circle.
#[test]
fn stiff_antagonists_with_a_low_limit_have_an_equilibrium() {
    let mut found = 0;
    for stiffness in ["1e4", "1e5", "1e6"] {
        for (flexor, extensor) in [(0.1, 0.1), (0.1, 0.6), (0.5, 0.9), (1.0, 0.2)] {
            let hand = fingers(&format!(
                "[motors.flexor]\nscaling = 0.02\nspeed_limit = 2\n[motors.extensor]\nscaling = 0.02\nspeed_limit = 2\n\
                 [tendons.flexor]\nmotors.flexor = 1\njoints = {{ a = 0.01, b = 0.008 }}\nstiffness = {stiffness}\nforce_limit = 12\n\
                 [tendons.extensor]\nmotors.extensor = 1\njoints = {{ a = -0.008, b = -0.009 }}\nstiffness = {stiffness}\nforce_limit = 9\n\
                 [tendons.other]\nmotors.extensor = 1\njoints = {{ a = -0.01, c = 0.004 }}\nstiffness = {stiffness}\nforce_limit = 2\n",
            ));
            let rest = solve_loaded(&Config::default(), &hand, Pose::IDENTITY, &[flexor, extensor], &[]);
            let rest = rest.unwrap_or_else(|why| panic!("{stiffness} {flexor} {extensor}: {why}"));
            found += usize::from(rest.method == Method::Newton);
        }
    }
    assert!(found > 6, "{found} cases beyond the closed form");
}
