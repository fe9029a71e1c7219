//! Cables that rub on their guides, and joints with dry friction, against closed forms.

use super::case::{Case, Finding};
use super::mechanism::{bare, hinge, loose};
use super::setup::{Setup, ends_of_steps, ramp, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::{bolted, softhand};
use anyhow::{Result, ensure};
use palmares_models::hand::path::{Polynomial, TendonPath};
use palmares_models::hand::tendon::TendonElement;
use palmares_models::hand::{Guide, Hand, HingeKind, Inertia, Link, MotorSettings, Tendon, TendonNumbers};
use palmares_models::{Mat3, Pose, Vec3};
use palmares_sim::{Command, Config, Model, State};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "capstan",
        "a cable over three joints, one of them with a varying arm, is wound in and out: T_out = T_in exp(-mu phi)",
        capstan,
    ),
    Case::ours(
        "capstan_loop",
        "tension over wound length of a closing and opening finger, against the polygon of its guides",
        capstan_loop,
    ),
    Case::ours("dry_slide", "a part with dry friction slides to a stop, and stays", dry_slide),
];

/// Stiffness of the joints, N·m/rad, and moment arms of the cable.
const JOINT: [f64; 3] = [0.3, 0.2, 0.1];
const ARM: [f64; 3] = [1.0, 0.8, 0.6];
/// Exponent μφ of each guide.
const EXPONENT: [f64; 3] = [0.1, 0.3, 0.6];
/// Damping of the joints, N·m·s/rad: they hardly ring when a guide lets go.
const DAMPING: f64 = 1e-3;
/// Stiffness of the cable, and the length that is wound.
const CABLE: f64 = 20.0;
const WOUND: f64 = 1.0;

/// A finger of three light joints in a row, and a cable over them.
fn finger() -> Result<Hand> {
    let part = Inertia {
        mass: 5e-3,
        com: Vec3::new(0.0, 0.02, 0.0),
        about_com: Mat3::from_diagonal(Vec3::splat(1e-6)),
    };
    let link = |k: usize| Link {
        name: format!("part {k}"),
        parent: Some(k),
        joint: Some(hinge(k, HingeKind::Revolute, Vec3::Z, Vec3::new(0.0, 0.04, 0.0))),
        inertia: part,
        geoms: Vec::new(),
    };
    let coordinate = |k: usize| {
        let mut coordinate = loose(&format!("joint {k}"));
        (coordinate.stiffness, coordinate.damping) = (JOINT[k], DAMPING);
        coordinate
    };
    let mut hand = Hand::clone(&bare("finger", (0..3).map(link).collect(), (0..3).map(coordinate).collect()));
    let guide = |k: usize| Guide::new(k, 0.2, EXPONENT[k] / 0.2);
    hand.gravity_compensation = true;
    let stock = softhand()?.tendons[0].clone();
    hand.tendons.push(Tendon {
        moment_arms: ARM.into_iter().enumerate().collect(),
        guides: (0..3).map(guide).collect(),
        numbers: TendonNumbers { stiffness: CABLE, force_limit: 1.0, ..stock.numbers },
        ..stock
    });
    hand.motors.push(MotorSettings::plain(WOUND, 0.0, 1e6).motor("motor"));
    Ok(hand)
}

fn started(hand: Hand, setup: &Setup) -> Result<(Box<dyn Engine>, Command)> {
    let model = Model::new(bolted(Config::with_step(setup.dt_s)), Some(Arc::new(hand)))?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let engine = setup.start(model, state)?;
    let command = Command::stay(engine.model(), Pose::IDENTITY);
    Ok((engine, command))
}

/// The cable is wound in for 4 s and out for 4 s. The figure is the largest error of the ratio `T_k / T_{k−1}` at a guide, in percent of
/// `e^{∓μφ}`. The tension beyond a guide is the torque of the joint's spring and damper over its arm.
pub fn capstan(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = finger()?;
    hand.tendons[0].moment_arms.pop();
    let path = Polynomial { coefficients: vec![ARM[2], 0.1] };
    hand.tendons[0].elements.push(TendonElement { coordinate: 2, path: TendonPath::Polynomial(path) });
    let joints = hand.coordinates.clone();
    let tendon = hand.tendons[0].clone();
    let (mut world, mut command) = started(hand, setup)?;
    let mut worst: f64 = 0.0;
    for t in ends_of_steps(8.0, setup.dt_s) {
        command.sigma[0] = ramp(0.25 * t).0 - ramp(0.25 * t - 1.0).0;
        let mut arms = [0.0; 3];
        tendon.gradient(&world.state().q, |c, r| arms[c] += r);
        recorder.step(&mut *world, &command)?;
        let direction = if t < 4.0 { -1.0 } else { 1.0 };
        // Every guide must slide. This excludes the ends, and the time between the turn and the slip of the last guide.
        if !((1.2..3.2).contains(&t) || (6.5..7.1).contains(&t)) {
            continue;
        }
        let state = world.state();
        let mut before = state.tension[0];
        for k in 0..3 {
            let torque = joints[k].stiffness * state.q[k] + joints[k].damping * state.v[6 + k];
            let beyond = torque / arms[k];
            worst = worst.max((beyond / before / (direction * EXPONENT[k]).exp() - 1.0).abs());
            before = beyond;
        }
    }
    Ok(recorder.finding(Figure::new("largest error of a tension ratio", 100.0 * worst, "%")))
}

/// Area of the loop of tension over wound length, N·m. All guides slide while the cable is wound in. After the turn they let go one
/// after the other, from the motor outwards: guide k lets go when `T_{k-1} e^{μφ}` has fallen to T_k.
fn area() -> f64 {
    let product = |k: usize, sign: f64| (sign * EXPONENT[..=k].iter().sum::<f64>()).exp();
    let compliance = |joints: usize, sign: f64| {
        (0..joints).map(|k| ARM[k] * ARM[k] / JOINT[k] * product(k, sign)).sum::<f64>() + 1.0 / CABLE
    };
    let top = WOUND / compliance(3, -1.0);
    let (mut s, mut tension, mut sum) = (WOUND, top, 0.5 * WOUND * top);
    for free in 0..3 {
        let next = top * product(free, -2.0);
        let way = (tension - next) * compliance(free, 1.0);
        sum -= 0.5 * (tension + next) * way;
        (s, tension) = (s - way, next);
    }
    sum - 0.5 * s * tension
}

/// The figure is the error of the loop's area in the second and third cycle of 8 s, in percent of the closed form. The work of the
/// dampers is subtracted. If the two cycles differ by more, the figure is their difference.
pub fn capstan_loop(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut world, mut command) = started(finger()?, setup)?;
    let mut found = [0.0; 3];
    let (mut wound, mut tension) = (0.0, 0.0);
    for (cycle, area) in found.iter_mut().enumerate() {
        for t in ends_of_steps(8.0, setup.dt_s) {
            command.sigma[0] = ramp(0.25 * t).0 - ramp(0.25 * t - 1.0).0;
            recorder.step(&mut *world, &command)?;
            let state = world.state();
            let now = (WOUND * command.sigma[0], state.tension[0]);
            *area += 0.5 * (tension + now.1) * (now.0 - wound);
            *area -= state.v[6..].iter().map(|rate| DAMPING * rate * rate).sum::<f64>() * setup.dt_s;
            (wound, tension) = now;
        }
        let open = world.state().q.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
        ensure!(open < 1e-3, "cycle {cycle} ends {open} rad off its beginning");
    }
    let exact = area();
    let errors = [found[1] - exact, found[2] - exact, found[2] - found[1]];
    let worst = errors.iter().fold(0.0, |most: f64, error| most.max(error.abs()));
    Ok(recorder.finding(Figure::new("error of the loop's area", 100.0 * worst / exact, "%")))
}

/// Mass, kg, dry friction, N, and speed, m/s, of the part that slides.
const SLIDER: (f64, f64, f64) = (0.5, 2.0, 1.0);

/// A part slides to a stop. The exact way is `m v²/(2 F)`. Then a load of 0.9 F acts for a minute. The figure is the larger length,
/// m: the error of the way, or the creep under the load. Energy that the part gains goes to `energy_gain_j`.
pub fn dry_slide(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mass, friction, speed) = SLIDER;
    let inertia = Inertia { mass, com: Vec3::ZERO, about_com: Mat3::from_diagonal(Vec3::splat(1e-3)) };
    let joint = hinge(0, HingeKind::Prismatic, Vec3::X, Vec3::ZERO);
    let link =
        Link { name: "slider".into(), parent: Some(0), joint: Some(joint), inertia, geoms: Vec::new() };
    let mut way = loose("way");
    way.friction = friction;
    let hand = Hand::clone(&bare("slider", vec![link], vec![way]));
    let (mut world, mut command) = started(hand, setup)?;
    world.state_mut().v[6] = speed;
    let (mut before, mut gain): (f64, f64) = (0.5 * mass * speed * speed, 0.0);
    for _ in 0..steps(0.5, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
        let energy = 0.5 * mass * world.state().v[6].powi(2);
        gain = gain.max(energy - before);
        before = energy;
    }
    let way = world.state().q[0];
    let error = (way - 0.5 * mass * speed * speed / friction).abs();
    // The load moves the part at once. Then the part holds.
    command.pushes =
        vec![palmares_sim::Push { link: 1, point: Vec3::ZERO, force: Vec3::X * (0.9 * friction) }];
    recorder.steps(&mut *world, &command, steps(1.0, setup.dt_s))?;
    let loaded = world.state().q[0];
    recorder.steps(&mut *world, &command, steps(60.0, setup.dt_s.max(1e-3)))?;
    let creep = (world.state().q[0] - loaded).abs();
    Ok(recorder.finding(Figure::new("error of the way", error.max(creep), "m")).with_energy_gain(gain))
}
