//! Oscillators with dry friction: each half cycle loses 2 F/k of its amplitude.

use super::case::{Case, Finding};
use super::mechanism::{bare, hinge, loose};
use super::scene::{G, SceneBuilder, awake, cuboid, push, velocity};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use crate::rigs::bolted;
use anyhow::Result;
use palmares_models::hand::{Geom, HingeKind, Inertia, Link};
use palmares_models::{Mat3, Pose, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "dry_joint",
        "a spring and a joint with dry friction: amplitude after four half cycles",
        dry_joint,
    ),
    Case::ours(
        "dry_contact",
        "a block that rubs on the floor under the push of a spring: the same",
        dry_contact,
    ),
    Case::ours(
        "dry_contact_joint",
        "a link on the spring of its joint that rubs on the floor",
        dry_contact_joint,
    ),
];

/// Mass, kg, spring, N/m, friction, N, and amplitude at the start, m.
const MASS: f64 = 1.0;
const SPRING: f64 = 100.0;
const FRICTION: f64 = 1.0;
const START_M: f64 = 0.2;
/// Half cycles, and the time for more of them than these, s.
const HALF_CYCLES: usize = 4;
const TIME_S: f64 = 1.5;

/// Amplitudes at the turns of an oscillator, from its places and speeds at the ends of steps.
struct Turns {
    before: (f64, f64),
    amplitudes: Vec<f64>,
}

impl Turns {
    fn new() -> Self {
        Turns { before: (START_M, 0.0), amplitudes: Vec::new() }
    }

    fn take(&mut self, place: f64, speed: f64) {
        let (x, v) = self.before;
        if v * speed < 0.0 {
            // The turn lies between two steps: spring and friction brake the rest of the speed.
            self.amplitudes.push(x.abs() + 0.5 * MASS * v * v / (SPRING * x.abs() + FRICTION));
        }
        if speed != 0.0 {
            self.before = (place, speed);
        }
    }

    /// Error of the amplitude after the half cycles, in percent of the exact one.
    fn finding(&self, recorder: &Recorder) -> Result<Finding> {
        let Some(last) = self.amplitudes.get(HALF_CYCLES - 1) else {
            anyhow::bail!("it turned only {} times", self.amplitudes.len())
        };
        let exact = START_M - 2.0 * HALF_CYCLES as f64 * FRICTION / SPRING;
        let error = 100.0 * (last / exact - 1.0).abs();
        Ok(recorder.finding(Figure::new("error of the amplitude", error, "%")))
    }
}

/// Error, in percent, of the amplitude after four half cycles of a part (1 kg) on a spring of 100 N/m whose joint has 1 N of dry
/// friction, from 0.2 m: exact is 0.12 m.
pub fn dry_joint(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let inertia = Inertia { mass: MASS, com: Vec3::ZERO, about_com: Mat3::from_diagonal(Vec3::splat(1e-3)) };
    let joint = hinge(0, HingeKind::Prismatic, Vec3::X, Vec3::ZERO);
    let link = Link { name: "part".into(), parent: Some(0), joint: Some(joint), inertia, geoms: Vec::new() };
    let mut way = loose("way");
    (way.stiffness, way.damping, way.rest, way.friction) = (SPRING, 0.0, 0.0, FRICTION);
    let hand = bare("oscillator", vec![link], vec![way]);
    let (mut engine, command) =
        SceneBuilder::with_hand(bolted(awake(setup.dt_s)), hand, Pose::IDENTITY)?.start(setup)?;
    engine.state_mut().q[0] = START_M;
    let mut turns = Turns::new();
    for _ in 0..steps(TIME_S, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        turns.take(engine.state().q[0], engine.state().v[6]);
    }
    turns.finding(recorder)
}

/// The same of a block on the floor. Its spring is a push, the mean of the spring's force over the step to the third order.
pub fn dry_contact(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let friction = FRICTION / (MASS * G);
    let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
        .floor(friction)?
        .body(cuboid(0.1, 0.1, 0.02), MASS, friction, Pose::translation(0.0, 0.0, 0.01))?
        .start(setup)?;
    recorder.steps(&mut *engine, &command, steps(0.3, setup.dt_s))?;
    engine.state_mut().objects[0].translation.x = START_M;
    let h = setup.dt_s;
    let mut turns = Turns::new();
    for _ in 0..steps(TIME_S, setup.dt_s) {
        let (x, v) = (engine.state().objects[0].translation.x, velocity(&*engine, 0).0.x);
        let rubbing = if v == 0.0 { -x } else { v }.signum() * FRICTION;
        let mean = x + 0.5 * h * v - h * h / 6.0 * (SPRING * x + rubbing) / MASS;
        push(&mut *engine, 0, Vec3::X * (-SPRING * mean), Vec3::ZERO);
        recorder.step(&mut *engine, &command)?;
        turns.take(engine.state().objects[0].translation.x, velocity(&*engine, 0).0.x);
    }
    turns.finding(recorder)
}

/// The same of a link that rubs on the floor, pressed by its weight: its joint along x has the spring, and the part between it and
/// the base, 1 g, slides along z.
pub fn dry_contact_joint(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (carrier, half) = (1e-3, 0.01);
    let friction = FRICTION / ((MASS + carrier) * G);
    let body =
        |mass: f64| Inertia { mass, com: Vec3::ZERO, about_com: Mat3::from_diagonal(Vec3::splat(1e-3)) };
    let geom = Geom { link_from_geom: Pose::IDENTITY, shape: cuboid(0.1, 0.1, 2.0 * half), friction };
    let links = [(carrier, Vec3::Z, Vec::new()), (MASS, Vec3::X, vec![geom])];
    let links = links.into_iter().enumerate().map(|(k, (mass, axis, geoms))| Link {
        name: format!("part {k}"),
        parent: Some(k),
        joint: Some(hinge(k, HingeKind::Prismatic, axis, Vec3::ZERO)),
        inertia: body(mass),
        geoms,
    });
    let free = |name: &str, stiffness: f64| {
        let mut way = loose(name);
        (way.stiffness, way.damping, way.rest, way.friction) = (stiffness, 0.0, 0.0, 0.0);
        way
    };
    let hand = bare("oscillator", links.collect(), vec![free("down", 0.0), free("along", SPRING)]);
    let (mut engine, command) =
        SceneBuilder::with_hand(bolted(awake(setup.dt_s)), hand, Pose::translation(0.0, 0.0, half))?
            .floor(friction)?
            .start(setup)?;
    // It sinks in until the contact carries it.
    recorder.steps(&mut *engine, &command, steps(0.3, setup.dt_s))?;
    engine.state_mut().q[1] = START_M;
    let mut turns = Turns::new();
    for _ in 0..steps(TIME_S, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        turns.take(engine.state().q[1], engine.state().v[7]);
    }
    turns.finding(recorder)
}
