//! Springs with dry friction, in second order.

use palmares_models::hand::{
    Coordinate, CoordinateSettings, Guide, Hand, Hinge, HingeKind, Inertia, Joint, Link, MotorSettings,
    Tendon, TendonNumbers,
};
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State, World};
use std::sync::Arc;

type Part = (HingeKind, Vec3, f64, Vec3);

/// A chain of parts: kind and axis of the joint, mass, and place of the centre of mass, which is also half of the way to the next.
fn chain(parts: &[Part], numbers: &[[f64; 2]]) -> Hand {
    let body = |mass: f64, com: Vec3| Inertia {
        mass,
        com,
        about_com: Mat3::from_diagonal(Vec3::splat(2e-4 * mass)),
    };
    let palm = Link {
        name: "palm".into(),
        parent: None,
        joint: None,
        inertia: body(0.5, Vec3::ZERO),
        geoms: Vec::new(),
    };
    let mut links = vec![palm];
    let mut coordinates = Vec::new();
    let mut at = Vec3::ZERO;
    for (k, ((kind, axis, mass, com), [stiffness, friction])) in parts.iter().zip(numbers).enumerate() {
        let parent_from_hinge = Pose::from_parts(at, Rotation::IDENTITY);
        let hinges = vec![Hinge { parent_from_hinge, axis: *axis, kind: *kind, ratio: 1.0, offset: 0.0 }];
        let joint = Some(Joint { name: format!("joint {k}"), coordinate: k, hinges });
        links.push(Link {
            name: format!("part {k}"),
            parent: Some(k),
            joint,
            inertia: body(*mass, *com),
            geoms: Vec::new(),
        });
        let numbers = CoordinateSettings::default().numbers();
        let mut coordinate = Coordinate { name: format!("joint {k}"), lower: -1e3, upper: 1e3, numbers };
        (coordinate.stiffness, coordinate.friction) = (*stiffness, *friction);
        (coordinate.damping, coordinate.rest) = (0.0, 0.0);
        coordinates.push(coordinate);
        at = *com * 2.0;
    }
    let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
    (hand.links, hand.coordinates) = (links, coordinates);
    (hand.gravity_compensation, hand.base_from_root) = (false, Pose::IDENTITY);
    (hand.start, hand.sensors) = (Default::default(), Default::default());
    hand.tendons.clear();
    hand.springs.clear();
    hand.linkages.clear();
    hand.motors.clear();
    hand.no_collision.clear();
    hand.tactile.clear();
    hand.pads.clear();
    hand.uncertain.clear();
    hand
}

fn world(hand: &Arc<Hand>, h: f64, bolted: bool, q: &[f64]) -> (World, Command) {
    let mut config = Config::with_step(h);
    config.base.bolted = bolted;
    let model = Arc::new(Model::new(config, Some(hand.clone())).expect("a hand"));
    let mut state = State::at_rest(&model, Pose::IDENTITY, &[]);
    state.q.copy_from_slice(q);
    let command = Command::stay(&model, Pose::IDENTITY);
    (World::new(model, state), command)
}

fn energy(world: &World) -> f64 {
    use palmares_sim::dynamics::{crba::Inertias, tree::Kinematics};
    let (model, state) = (world.model(), world.state());
    let hand = model.hand().unwrap();
    let (mut kin, mut inertias, mut velocity) = (Kinematics::default(), Inertias::default(), Vec::new());
    kin.update(hand, state.base, &state.q);
    inertias.update(hand, &kin, 0);
    kin.velocities(hand, &state.v[..model.hand_dofs()], &mut velocity);
    let mut sum = 0.0;
    for (i, link) in hand.links.iter().enumerate() {
        sum += 0.5 * velocity[i].dot(inertias.link[i].mul(velocity[i]));
        if !hand.gravity_compensation {
            sum -=
                link.inertia.mass * model.config().gravity.dot(kin.pose[i].transform_point(link.inertia.com));
        }
    }
    for (q, c) in state.q.iter().zip(&hand.coordinates) {
        sum += 0.5 * c.stiffness * (q - c.rest).powi(2);
    }
    for spring in &hand.springs {
        sum += 0.5 * spring.stiffness * spring.stretch(&state.q).powi(2);
    }
    for tendon in &hand.tendons {
        let wound = tendon.wound(&hand.motors, |motor| state.motors[motor].position);
        let x = (wound - tendon.length(&state.q)).max(0.0);
        sum += 0.5 * tendon.stiffness * x * x;
    }
    sum
}

/// Final q, largest rise of energy between steps, total fall
fn run(
    hand: &Arc<Hand>,
    h: f64,
    bolted: bool,
    q: &[f64],
    sigma: f64,
    time: f64,
) -> (Vec<f64>, Vec<f64>, f64, f64) {
    let (mut world, mut command) = world(hand, h, bolted, q);
    if !command.sigma.is_empty() {
        command.sigma[0] = sigma;
    }
    let (mut before, mut rise) = (energy(&world), 0.0f64);
    let start = before;
    let (mut least, mut total) = (before, 0.0f64);
    let mut path = Vec::new();
    for k in 0..(time / h).round() as usize {
        let was =
            (world.state().tension.clone(), world.state().friction.clone(), world.state().v[6..].to_vec());
        let outcome = world.step(&command);
        if !outcome.converged {
            println!("not converged at {k} {:?} {:?} {:?}", world.fault(), world.state().q, world.state().v);
            return (world.state().q.clone(), vec![], 0.0, 0.0);
        }
        let now = energy(&world);
        if now - before > 1e-5 * start && sigma == 0.0 && start > 0.0 && std::env::var("SHOW").is_ok() {
            let turn = world.state().v[6..].iter().map(|v| (v * h).abs()).fold(0.0, f64::max);
            println!(
                "h {h} step {k} rise {:.1e} turn {turn:.3} v {:.2?} tension {:.4?} friction {:.4?} was {was:.4?}",
                (now - before) / start,
                &world.state().v[6..],
                world.state().tension,
                world.state().friction
            );
        }
        rise = rise.max(now - before);
        least = least.min(now);
        total = total.max(now - least);
        before = now;
        if ((k + 1) as f64 * h / 0.016).fract() < 1e-6 || ((k + 1) as f64 * h / 0.016).fract() > 1.0 - 1e-6 {
            path.extend_from_slice(&world.state().q);
        }
    }
    let _ = total;
    (world.state().q.clone(), path, rise / (start.abs() + 1e-12), total / (start.abs() + 1e-12))
}

fn study(name: &str, hand: &Arc<Hand>, bolted: bool, q: &[f64], sigma: f64, time: f64) {
    let (end, fine, ..) = run(hand, 1e-3 / 64.0, bolted, q, sigma, time);
    let n = end.len();
    for h in [16e-3, 8e-3, 4e-3, 2e-3, 1e-3, 0.5e-3] {
        let (last, path, rise, total) = run(hand, h, bolted, q, sigma, time);
        let worst = path.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let off = last.iter().zip(&end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let size = fine.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        println!(
            "{name} {:5} ms: path {:.3e} end {:.3e} of {size:.3} (n {n}), rise {rise:.1e} total {total:.1e}",
            h * 1e3,
            worst,
            off
        );
    }
}

#[test]
fn oscillators() {
    for (k, m, part) in [
        (100.0, 1.0, 0.05),
        (100.0, 1.0, 0.01),
        (1000.0, 1.0, 0.05),
        (1e4, 1.0, 0.05),
        (2.0, 0.02, 0.05),
        (50.0, 0.02, 0.05),
    ] {
        let (start, w) = (0.2, libm::sqrt(k / m));
        let f = part * k * start;
        let hand = Arc::new(chain(&[(HingeKind::Prismatic, Vec3::X, m, Vec3::ZERO)], &[[k, f]]));
        for h in [0.25e-3, 1e-3, 4e-3, 8e-3, 16e-3] {
            let (mut world, command) = world(&hand, h, true, &[start]);
            let (mut turns, mut before) = (Vec::new(), (start, 0.0f64));
            for _ in 0..(5.0 * 3.1416 / w / h) as usize + 3 {
                world.step(&command);
                let (x, v) = (world.state().q[0], world.state().v[6]);
                if before.1 * v < 0.0 {
                    turns.push(before.0.abs() + 0.5 * m * before.1 * before.1 / (k * before.0.abs() + f));
                }
                if v != 0.0 {
                    before = (x, v);
                }
            }
            let exact = start - 8.0 * f / k;
            let found = turns.get(3).copied().unwrap_or(0.0);
            println!(
                "k {k} m {m} F {f} h {} wh {:.3}: {:.3} %",
                h * 1e3,
                w * h,
                100.0 * (found / exact - 1.0)
            );
        }
    }
}

#[test]
fn studies() {
    let slide = |m: f64| (HingeKind::Prismatic, Vec3::X, m, Vec3::ZERO);
    let two = chain(&[slide(0.5), slide(0.3)], &[[100.0, 0.4], [60.0, 0.2]]);
    study("chain", &two.into(), true, &[0.2, -0.1], 0.0, 1.28);
    let bar = |m: f64| (HingeKind::Revolute, Vec3::Z, m, Vec3::Y * 0.02);
    let bars = [bar(0.05), bar(0.04), bar(0.03)];
    let finger = chain(&bars, &[[0.05, 5e-4], [0.03, 5e-4], [0.01, 5e-4]]);
    study("finger", &finger.clone().into(), true, &[1.0, -0.5, 0.8], 0.0, 1.28);
    study("finger on servo", &finger.clone().into(), false, &[1.0, -0.5, 0.8], 0.0, 1.28);
    let hang = |m: f64| (HingeKind::Revolute, Vec3::X, m, Vec3::Z * -0.1);
    for friction in [5e-4, 1e-6] {
        let pendulum = chain(&[hang(0.05), hang(0.04)], &[[0.0, friction]; 2]);
        study(&format!("pendulum {friction}"), &pendulum.into(), true, &[1.0, -0.5], 0.0, 1.28);
    }
    let pendulum = chain(&[hang(0.05)], &[[0.0, 1e-8]]);
    study("one pendulum without friction", &pendulum.into(), true, &[1.0], 0.0, 5.12);
    let mut smooth = finger.clone();
    smooth.coordinates.iter_mut().for_each(|c| c.friction = 1e-8);
    study("finger, hardly any friction", &smooth.into(), true, &[1.0, -0.5, 0.8], 0.0, 1.28);
    for (stiffness, friction) in [(2000.0, 0.2), (2000.0, 0.02), (2e5, 0.2), (2e5, 0.002)] {
        let mut cable = chain(&bars, &[[0.3, 0.0], [0.2, 0.0], [0.1, 0.0]]);
        let stock = Hand::builtin("softhand").expect("built in").tendons[0].clone();
        cable.tendons.push(Tendon {
            moment_arms: vec![(0, 0.01), (1, 0.008), (2, 0.006)],
            guides: [0.5, 1.0, 1.5]
                .into_iter()
                .enumerate()
                .map(|(k, a)| Guide::new(k, friction, a))
                .collect(),
            numbers: TendonNumbers { stiffness, force_limit: 500.0, damping: 0.0, ..stock.numbers },
            ..stock
        });
        cable.motors.push(MotorSettings::plain(0.02, 0.0, 1e6).motor("motor"));
        let cable: Arc<Hand> = cable.into();
        study(&format!("cable {stiffness} {friction}"), &cable, true, &[0.3, -0.2, 0.2], 0.7, 0.64);
        study("cable slack", &cable, true, &[0.3, -0.2, 0.2], 0.0, 0.64);
    }
}
