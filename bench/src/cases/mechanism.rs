//! Small hands as textbook mechanisms, and what a free hand conserves.

use super::case::{Case, Finding};
use super::elliptic::complete;
use super::scene::{G, SceneBuilder, awake, set_velocity, spin, velocity, weightless};
use super::setup::{Setup, steps};
use crate::audit::mechanical;
use crate::case_report::{Figure, Invariants};
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::bolted;
use crate::rigs::softhand;
use anyhow::Result;
use palmares_models::hand::{Coordinate, CoordinateSettings, Hand, Hinge, HingeKind, Inertia, Joint, Link};
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Vec3};
use palmares_sim::BaseCommand;
use palmares_sim::dynamics::tree::Kinematics;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("pendulum", "rod pendulum released at 170 degrees swings for 100 periods", pendulum),
    Case::new(
        "heavy_top",
        "spinning top on a fixed point precesses steadily under its weight for 10 s",
        heavy_top,
    ),
    Case::new(
        "momentum_inelastic_hit",
        "10 kg ball at 5 m/s hits a free SoftHand without gravity and friction",
        momentum_inelastic_hit,
    ),
    Case::ours(
        "singular_arm",
        "an arm of two bars swings through its stretched and folded positions: energy and angular momentum",
        singular_arm,
    ),
];

/// A hand without tendons: a base of 1 kg and `links` that hang from it.
pub(crate) fn bare(name: &str, links: Vec<Link>, coordinates: Vec<Coordinate>) -> Arc<Hand> {
    let base = Link {
        name: "base".into(),
        parent: None,
        joint: None,
        inertia: Inertia { mass: 1.0, com: Vec3::ZERO, about_com: Mat3::from_diagonal(Vec3::splat(1e-2)) },
        geoms: Vec::new(),
    };
    Arc::new(Hand {
        name: name.into(),
        description: String::new(),
        links: std::iter::once(base).chain(links).collect(),
        coordinates,
        tendons: Vec::new(),
        springs: Vec::new(),
        linkages: Vec::new(),
        motors: Vec::new(),
        gravity_compensation: false,
        no_collision: Vec::new(),
        tactile: Vec::new(),
        sensors: Default::default(),
        pads: Vec::new(),
        start: palmares_models::hand::Start::default(),
        uncertain: Vec::new(),
        base_from_root: palmares_models::Pose::IDENTITY,
    })
}

/// A coordinate without spring, damper and stop.
pub(crate) fn loose(name: &str) -> Coordinate {
    let (lower, upper) = (-1e3, 1e3);
    Coordinate { name: name.into(), lower, upper, numbers: CoordinateSettings::default().numbers() }
}

/// A joint of one hinge at a place of its parent.
pub(crate) fn hinge(coordinate: usize, kind: HingeKind, axis: Vec3, at: Vec3) -> Joint {
    let parent_from_hinge = Pose::from_parts(at, palmares_models::Rotation::IDENTITY);
    Joint {
        name: format!("joint {coordinate}"),
        coordinate,
        hinges: vec![Hinge { parent_from_hinge, axis, kind, ratio: 1.0, offset: 0.0 }],
    }
}

/// A rod of length L and 0.2 kg that hangs from a hinge about y.
const ROD_M: f64 = 0.5;
const ROD_KG: f64 = 0.2;

fn rod() -> Arc<Hand> {
    let across = ROD_KG * ROD_M * ROD_M / 12.0;
    let inertia = Inertia {
        mass: ROD_KG,
        com: Vec3::new(0.0, 0.0, -0.5 * ROD_M),
        about_com: Mat3::from_diagonal(Vec3::new(across, across, 1e-3 * across)),
    };
    let joint = hinge(0, HingeKind::Revolute, Vec3::Y, Vec3::ZERO);
    let link = Link { name: "rod".into(), parent: Some(0), joint: Some(joint), inertia, geoms: Vec::new() };
    bare("pendulum", vec![link], vec![loose("swing")])
}

/// Relative error of the period, in percent, over 100 periods of a rod pendulum from θ₀ = 170°:
/// `T = 4 √(2 L/(3 g)) K(sin(θ₀/2))`. The largest change of its energy goes to `energy_gain_j`; it has
/// 0.97 J.
pub fn pendulum(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let start = 170f64.to_radians();
    let exact = 4.0 * (2.0 * ROD_M / (3.0 * G)).sqrt() * complete((0.5 * start).sin());
    let (mut engine, command) =
        SceneBuilder::with_hand(bolted(awake(setup.dt_s)), rod(), Pose::IDENTITY)?.start(setup)?;
    engine.state_mut().q[0] = start;
    let about_pivot = ROD_KG * ROD_M * ROD_M / 3.0;
    let energy = |engine: &dyn Engine| {
        let (q, rate) = (engine.state().q[0], engine.state().v[6]);
        0.5 * about_pivot * rate * rate + 0.5 * ROD_KG * G * ROD_M * (1.0 - q.cos())
    };
    let begin = energy(&*engine);
    let (mut drift, mut zeros): (f64, Vec<f64>) = (0.0, Vec::new());
    let mut before = start;
    for k in 0..steps(101.0 * exact, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let now = engine.state().q[0];
        if now.signum() != before.signum() {
            zeros.push((k as f64 + before / (before - now)) * setup.dt_s);
        }
        before = now;
        drift = drift.max((energy(&*engine) - begin).abs());
    }
    // Two zeros a period; the first is a quarter of it after the release.
    let period = match zeros.as_slice() {
        [first, .., last] => 2.0 * (last - first) / (zeros.len() - 1) as f64,
        _ => f64::INFINITY,
    };
    let error = Figure::new("period error", 100.0 * (period / exact - 1.0).abs(), "%");
    Ok(recorder.finding(error).with_energy_gain(drift))
}

/// Distance of the top's centre of mass from its fixed point, m, and its mass, kg.
const TOP_ARM_M: f64 = 0.1;
const TOP_KG: f64 = 1.0;
/// About its axis, and across it about the fixed point, kg·m²: a disc of R = 0.1 m, h = 0.02 m.
const TOP_AXIAL: f64 = 0.5 * TOP_KG * 0.01;
const TOP_ACROSS: f64 = TOP_KG * (0.25 * 0.01 + 0.0004 / 12.0 + TOP_ARM_M * TOP_ARM_M);

/// A top in gimbals: coordinates are precession about z, nutation about the line of nodes, and spin. Gimbals that weigh
/// the same in every direction change nothing of a steady precession.
fn top() -> Arc<Hand> {
    let gimbal = Inertia { mass: 1e-3, com: Vec3::ZERO, about_com: Mat3::from_diagonal(Vec3::splat(1e-5)) };
    let across = TOP_ACROSS - TOP_KG * TOP_ARM_M * TOP_ARM_M;
    let disc = Inertia {
        mass: TOP_KG,
        com: Vec3::new(0.0, 0.0, TOP_ARM_M),
        about_com: Mat3::from_diagonal(Vec3::new(across, across, TOP_AXIAL)),
    };
    let parts = [("outer", Vec3::Z, gimbal), ("inner", Vec3::X, gimbal), ("top", Vec3::Z, disc)];
    let link = |(k, (name, axis, inertia)): (usize, (&str, Vec3, Inertia))| Link {
        name: name.into(),
        parent: Some(k),
        joint: Some(hinge(k, HingeKind::Revolute, axis, Vec3::ZERO)),
        inertia,
        geoms: Vec::new(),
    };
    let links = parts.into_iter().enumerate().map(link).collect();
    bare("top", links, ["precession", "nutation", "spin"].map(loose).into())
}

/// Relative error of the rate, in percent, at which a top leaning by 60° and turning with ω₃ = 60 rad/s about its axis
/// precesses in 10 s. Exact: the slow root of `I₁ cos θ Ω² − I₃ ω₃ Ω + m g l = 0`, 3.53 rad/s. The largest change of its
/// energy goes to `energy_gain_j`; it has 9.5 J.
pub fn heavy_top(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (lean, w3) = (60f64.to_radians(), 60.0);
    let (a, b, c) = (TOP_ACROSS * lean.cos(), TOP_AXIAL * w3, TOP_KG * G * TOP_ARM_M);
    let exact = (b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let (mut engine, command) =
        SceneBuilder::with_hand(bolted(awake(setup.dt_s)), top(), Pose::IDENTITY)?.start(setup)?;
    let state = engine.state_mut();
    state.q[1] = lean;
    (state.v[6], state.v[8]) = (exact, w3 - exact * lean.cos());
    let (begin, mut drift): (f64, f64) = (mechanical(&*engine), 0.0);
    let count = steps(10.0, setup.dt_s);
    for _ in 0..count {
        recorder.step(&mut *engine, &command)?;
        drift = drift.max((mechanical(&*engine) - begin).abs());
    }
    let rate = engine.state().q[0] / (count as f64 * setup.dt_s);
    let error = Figure::new("precession rate error", 100.0 * (rate / exact - 1.0).abs(), "%");
    Ok(recorder.finding(error).with_energy_gain(drift))
}

/// Momentum and angular momentum (about the world's origin) of everything that moves.
fn momenta(engine: &dyn Engine) -> (Vec3, Vec3) {
    let (model, state) = (engine.model(), engine.state());
    let (mut p, mut l) = (Vec3::ZERO, Vec3::ZERO);
    for (k, object) in model.objects().iter().enumerate() {
        let share = velocity(engine, k).0 * object.mass;
        p += share;
        l += state.objects[k].translation.cross(share) + spin(engine, k);
    }
    if let Some(hand) = model.hand() {
        let (mut kin, mut motions) = (Kinematics::default(), Vec::new());
        kin.update(hand, state.base, &state.q);
        kin.velocities(hand, &state.v, &mut motions);
        for (i, link) in hand.links.iter().enumerate() {
            let turn = kin.rotation[i];
            let com = kin.pose[i].transform_point(link.inertia.com);
            let share = motions[i].at(com - kin.origin) * link.inertia.mass;
            let own = turn * (link.inertia.about_com * (turn.transpose() * motions[i].angular));
            p += share;
            l += com.cross(share) + own;
        }
    }
    (p, l)
}

/// Mean over steps of |p − p₀|², (kg m/s)², in 0.5 s in which a 10 kg ball (r = 0.1 m) at 5 m/s hits the palm of a SoftHand
/// that nothing holds, without gravity, friction and restitution; |L − L₀| of L₀ (about the hand's base) must be
/// constant too and its largest change, in percent, goes to `momentum_error_percent`. Published for the same test on
/// a quadruped at 1 ms (SimBenchmark): Bullet 2.7e-4, MuJoCo Euler 1.1e-3, MuJoCo RK4 3e-13, ODE 5e-26, DART 169.
pub fn momentum_inelastic_hit(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut hand = Hand::clone(&*softhand()?);
    for geom in hand.links.iter_mut().flat_map(|link| &mut link.geoms) {
        geom.friction = 0.0;
    }
    let (mut engine, mut command) =
        SceneBuilder::with_hand(weightless(setup.dt_s), Arc::new(hand), Pose::IDENTITY)?
            .body(Shape::Sphere { radius: 0.1 }, 10.0, 0.0, Pose::translation(0.3, 0.01, 0.08))?
            .start(setup)?;
    set_velocity(&mut *engine, 0, Vec3::new(-5.0, 0.0, 0.0), Vec3::ZERO);
    command.base = BaseCommand::Free;
    let (p0, l0) = momenta(&*engine);
    let e0 = mechanical(&*engine);
    let (mut sum, mut turned): (f64, f64) = (0.0, 0.0);
    let count = steps(0.5, setup.dt_s);
    for _ in 0..count {
        recorder.step(&mut *engine, &command)?;
        let (p, l) = momenta(&*engine);
        sum += (p - p0).length_squared();
        turned = turned.max((l - l0).length() / l0.length());
    }
    anyhow::ensure!(mechanical(&*engine) < 0.99 * e0, "the ball missed the hand");
    Ok(Finding {
        error: Figure::new("mean squared change of momentum", sum / count as f64, "(kg m/s)^2"),
        invariants: Invariants { momentum_error_percent: Some(100.0 * turned), ..recorder.invariants() },
    })
}

/// Length and mass of a bar of the arm; speeds of shoulder and elbow at the start, rad/s.
const BAR_M: f64 = 0.25;
const BAR_KG: f64 = 0.2;
const ARM_RAD_S: [f64; 2] = [-2.0, 7.0];

/// Largest change in 10 s, in percent, of the energy and of the angular momentum about the shoulder of an arm of two bars that turns
/// about its fixed shoulder without weight and drives. The elbow turns round and round: where it is straight and where it is folded, the
/// Jacobian of the tip is singular. Exact: both are constant.
pub fn singular_arm(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let across = BAR_KG * BAR_M * BAR_M / 12.0;
    let inertia = Inertia {
        mass: BAR_KG,
        com: Vec3::new(0.0, 0.0, -0.5 * BAR_M),
        about_com: Mat3::from_diagonal(Vec3::new(across, across, 1e-3 * across)),
    };
    let bar = |(k, name): (usize, &str)| Link {
        name: name.into(),
        parent: Some(k),
        joint: Some(hinge(k, HingeKind::Revolute, Vec3::Y, Vec3::NEG_Z * (k as f64 * BAR_M))),
        inertia,
        geoms: Vec::new(),
    };
    let links = ["upper", "fore"].into_iter().enumerate().map(bar).collect();
    let arm = bare("arm", links, ["shoulder", "elbow"].map(loose).into());
    let (mut engine, command) =
        SceneBuilder::with_hand(bolted(weightless(setup.dt_s)), arm, Pose::IDENTITY)?.start(setup)?;
    engine.state_mut().v[6..].copy_from_slice(&ARM_RAD_S);
    let (energy, momentum) = (mechanical(&*engine), momenta(&*engine).1.y);
    let mut worst: f64 = 0.0;
    for _ in 0..steps(10.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        worst = worst.max((mechanical(&*engine) / energy - 1.0).abs());
        worst = worst.max((momenta(&*engine).1.y / momentum - 1.0).abs());
    }
    let turns = engine.state().q[1].abs() / (2.0 * std::f64::consts::PI);
    anyhow::ensure!(turns > 3.0, "the elbow turned round {turns} times only");
    Ok(recorder.finding(Figure::new("change of energy or angular momentum", 100.0 * worst, "%")))
}
