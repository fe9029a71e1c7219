//! Friction's torque about the normal of flat contacts: a rod pinched off its centre of mass, a disc that slides and spins.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, set_velocity, settle, velocity};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, HingeKind, Pad, PadOn};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "pinch_tilt_torsion",
        "rod between two round pads: how far from its centre it can be held level",
        pinch_tilt_torsion,
    ),
    Case::ours("round_tips", "rod between two soft round tips, and a ball that spins to a stop", round_tips),
    Case::ours(
        "soft_tip_creep",
        "rod held off its middle by two soft round tips: creep in a minute",
        soft_tip_creep,
    ),
    Case::ours("patch_spin", "disc, square and fingertip spin to a stop under an even pressure", patch_spin),
    Case::new("disc_contensou", "disc that slides and spins on a plane: both end together", disc_contensou),
];

/// Error, in percent, of the largest distance from its centre of mass at which a rod (0.2 kg) can be pinched
/// with N = 20 N by two round pads (R_c = 1 cm, μ = 0.5) without tilting, against `m g e = 2 · ⅔ μ N R_c`,
/// `e` = 68 mm, for evenly pressing pads. Pads that press at the rims alone hold up to 102 mm, half as far
/// again.
pub fn pinch_tilt_torsion(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let radius = 0.01;
    let tips = Tips { shape: Shape::Cylinder { radius, half_length: 0.005 }, half: 0.005, pad: None };
    let exact = 4.0 / 3.0 * MU * PRESS_N * radius / (ROD_KG * G);
    let (mut low, mut high) = (0.2 * exact, 2.0 * exact);
    while high - low > 0.005 * exact {
        let offset = 0.5 * (low + high);
        if tilts(setup, recorder, &tips, offset)? {
            high = offset;
        } else {
            low = offset;
        }
    }
    Ok(recorder.finding(Figure::new(
        "error of the largest offset",
        100.0 * (0.5 * (low + high) / exact - 1.0),
        "%",
    )))
}

/// Largest error, in percent, of the time in which a rod (0.2 kg, 2 x 2 x 40 cm) that spins at 5 rad/s between two
/// round tips (R = 8 mm, μ = 0.5, 20 N) loses nine tenths of it, without weight: `0.9 I ω/(2 μ N arm)`. The tips are a
/// layer of 3 mm and 0.2 MPa on something hard (Winkler), where `a⁴ = 4 N R t/(π E)` and friction's arm is `8/15 a`, or
/// a body of 1 MPa (Hertz), `a³ = 3 N R/(4 E*)` and `3π/16 a`. And of that of a ball (5 cm, 1 kg, lever 2 mm) on the
/// floor at 20 rad/s, `0.9 I ω/(m g · 2 mm)`.
pub fn round_tips(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    let layer = (4.0 * PRESS_N * TIP_M * LAYER_M / (PI * LAYER_PA)).sqrt().sqrt();
    let body = libm::cbrt(0.75 * PRESS_N * TIP_M / BODY_PA);
    for (tips, arm) in soft_tips().into_iter().zip([8.0 / 15.0 * layer, 3.0 * PI / 16.0 * body]) {
        let config = Config { gravity: Vec3::ZERO, ..awake(setup.dt_s) };
        let (mut engine, command) = between(setup, config, &tips, 0.0)?;
        settle(&mut *engine, &command, 0.3)?;
        let omega = 5.0;
        set_velocity(&mut *engine, 0, Vec3::ZERO, Vec3::new(omega, 0.0, 0.0));
        let inertia = ROD_KG * (0.4f64.powi(2) + (2.0 * ROD_HALF_M).powi(2)) / 12.0;
        let exact = 0.9 * inertia * omega / (2.0 * MU * PRESS_N * arm);
        let time = time_to_a_tenth(&mut *engine, &command, recorder, Vec3::new(omega, 0.0, 0.0))?;
        worst = worst.max((time / exact - 1.0).abs());
    }
    let lever = 2e-3;
    let ball = Object::new("ball", vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })], 1.0, MU, 1e-3)?;
    let scene = SceneBuilder::new(awake(setup.dt_s))?.floor(MU)?;
    let (mut engine, command) = scene
        .object(ball.with_torsional_friction(lever)?, Pose::translation(0.0, 0.0, 0.05))?
        .start(setup)?;
    settle(&mut *engine, &command, 0.3)?;
    let omega = 20.0;
    set_velocity(&mut *engine, 0, Vec3::ZERO, Vec3::new(0.0, 0.0, omega));
    let exact = 0.9 * 0.4 * 0.05f64.powi(2) * omega / (G * lever);
    let time = time_to_a_tenth(&mut *engine, &command, recorder, Vec3::new(0.0, 0.0, omega))?;
    worst = worst.max((time / exact - 1.0).abs());
    Ok(recorder.finding(Figure::new("largest error of the time", 100.0 * worst, "%")))
}

/// Displacement, µm, of the ends of the same rod in a minute, held 15 mm off its middle by the same tips.
/// Exact: 0.
pub fn soft_tip_creep(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for tips in soft_tips() {
        let (mut engine, command) = between(setup, awake(setup.dt_s), &tips, 0.015)?;
        // A soft tip swings for long.
        recorder.steps(&mut *engine, &command, steps(20.0, setup.dt_s))?;
        let ends = |pose: &Pose| [-0.2, 0.2].map(|y| pose.transform_point(Vec3::new(0.0, y, 0.0)));
        let before = ends(&engine.state().objects[0]);
        recorder.steps(&mut *engine, &command, steps(60.0, setup.dt_s))?;
        let after = ends(&engine.state().objects[0]);
        let held = after.iter().all(|end| end.z.abs() < 0.02);
        anyhow::ensure!(held, "the rod was not held");
        worst = before.iter().zip(&after).fold(worst, |most, (a, b)| most.max(a.distance(*b)));
    }
    Ok(recorder.finding(Figure::new("creep in a minute", worst * 1e6, "um")))
}

/// Radius of a soft tip, m; thickness, m, and modulus, Pa, of a layer; modulus of a soft body, Pa.
const TIP_M: f64 = 0.008;
const LAYER_M: f64 = 3e-3;
const LAYER_PA: f64 = 2e5;
const BODY_PA: f64 = 1e6;

/// A tip with a soft layer, and a soft one.
fn soft_tips() -> [Tips; 2] {
    [Pad { thickness: Some(LAYER_M), modulus: LAYER_PA }, Pad { thickness: None, modulus: BODY_PA }]
        .map(|pad| Tips { shape: Shape::Sphere { radius: TIP_M }, half: TIP_M, pad: Some(pad) })
}

/// Force with which a rod is pinched, N; friction coefficient, mass, kg, and half the thickness, m, of the rod.
const PRESS_N: f64 = 20.0;
const MU: f64 = 0.5;
const ROD_KG: f64 = 0.2;
const ROD_HALF_M: f64 = 0.01;

/// The tips that pinch a rod.
struct Tips {
    shape: Shape,
    /// From a tip's middle to its surface, m.
    half: f64,
    pad: Option<Pad>,
}

/// A rod between two tips, `offset` from its middle, m.
fn between(setup: &Setup, config: Config, tips: &Tips, offset: f64) -> Result<(Box<dyn Engine>, Command)> {
    let tip = |link_from_geom| Geom { link_from_geom, shape: tips.shape.clone(), friction: MU };
    let across = Rotation::from_rotation_y(-FRAC_PI_2);
    let at = |x: f64| Pose::from_parts(Vec3::new(x, 0.0, 0.0), across);
    let finger = Finger {
        kind: HingeKind::Prismatic,
        base_from_hinge: at(ROD_HALF_M + tips.half),
        mass: 0.05,
        inertia: 1e-5,
        stiffness: 0.0,
        damping: 1.0,
        tension: PRESS_N,
        geoms: vec![tip(Pose::IDENTITY)],
    };
    let mut hand = fingers("tips", vec![tip(at(-ROD_HALF_M - tips.half))], vec![finger])?;
    hand.pads = tips.pad.iter().flat_map(|&pad| [0, 1].map(|link| PadOn { link, geom: 0, pad })).collect();
    let rod = cuboid(2.0 * ROD_HALF_M, 0.4, 2.0 * ROD_HALF_M);
    let (engine, mut command) = SceneBuilder::with_hand(bolted(config), Arc::new(hand), Pose::IDENTITY)?
        .body(rod, ROD_KG, MU, Pose::translation(0.0, offset, 0.0))?
        .start(setup)?;
    // The cable is wound far beyond its largest tension, which therefore acts all the time.
    command.sigma[0] = 1.0;
    Ok((engine, command))
}

fn tilts(setup: &Setup, recorder: &mut Recorder, tips: &Tips, offset: f64) -> Result<bool> {
    let (mut engine, command) = between(setup, awake(setup.dt_s), tips, offset)?;
    for _ in 0..steps(0.5, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        if (engine.state().objects[0].rotation * Vec3::Z).z < 0.9994 {
            return Ok(true);
        }
    }
    Ok(false)
}

/// v/(R ω) at the end of a disc (R = 0.05 m, 0.1 kg, μ = 0.3) that starts with v = 0.5 m/s and ω = 10 rad/s,
/// as error in percent of 0.6530, the limit under an even pressure (Farkas et al. 2003, Phys. Rev. Lett. 90,
/// 248302). Ours presses at single points of the rim, for which the limit is another.
pub fn disc_contensou(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let radius = 0.05;
    let disc = Shape::Cylinder { radius, half_length: 0.005 };
    let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
        .floor(0.3)?
        .body(disc, 0.1, 0.3, Pose::translation(0.0, 0.0, 0.005))?
        .start(setup)?;
    settle(&mut *engine, &command, 0.5)?;
    set_velocity(&mut *engine, 0, Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, 0.0, 10.0));
    let mut ratio = f64::INFINITY;
    for _ in 0..steps(2.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let (linear, angular) = velocity(&*engine, 0);
        // Until a fiftieth of the speeds is left: below it the deadband and the anchors act.
        if linear.length() > 0.01 && angular.z.abs() > 0.2 {
            ratio = linear.length() / (radius * angular.z.abs());
        }
    }
    Ok(recorder.finding(Figure::new(
        "error of v/(R w) at the end",
        100.0 * (ratio / 0.6530 - 1.0).abs(),
        "%",
    )))
}

/// Largest relative error, in percent, of the time in which a disc (5 cm), a square (8 cm) and a pad (30 x 14 mm) that spin at
/// 20 rad/s on a plane with μ = 0.5 lose nine tenths of it, `0.9 I ω/(μ m g ρ)` with the mean distance ρ of their points from the
/// middle: 2/3 R; `a (√2 + asinh 1)/6`; that of a rectangle.
pub fn patch_spin(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mu, omega) = (0.5, 20.0);
    let square = 0.08 * (2f64.sqrt() + libm::asinh(1.0)) / 6.0;
    let scenes = [
        (Shape::Cylinder { radius: 0.05, half_length: 0.005 }, 0.5 * 0.05f64.powi(2), 2.0 / 3.0 * 0.05),
        (cuboid(0.08, 0.08, 0.01), 0.08f64.powi(2) / 6.0, square),
        (cuboid(0.03, 0.014, 0.01), (0.03f64.powi(2) + 0.014f64.powi(2)) / 12.0, rectangle(0.03, 0.014)),
    ];
    let mut worst: f64 = 0.0;
    for (shape, gyration, radius) in scenes {
        let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
            .floor(mu)?
            .body(shape, 0.1, mu, Pose::translation(0.0, 0.0, 0.005))?
            .start(setup)?;
        settle(&mut *engine, &command, 0.3)?;
        set_velocity(&mut *engine, 0, Vec3::ZERO, Vec3::new(0.0, 0.0, omega));
        let exact = 0.9 * gyration * omega / (mu * G * radius);
        let time = time_to_a_tenth(&mut *engine, &command, recorder, Vec3::new(0.0, 0.0, omega))?;
        worst = worst.max((time / exact - 1.0).abs());
    }
    Ok(recorder.finding(Figure::new("largest error of the time", 100.0 * worst, "%")))
}

/// Time until the first object's spin has fallen to a tenth of ω, s; 0 if that takes more than a second.
fn time_to_a_tenth(
    engine: &mut dyn Engine,
    command: &Command,
    recorder: &mut Recorder,
    omega: Vec3,
) -> Result<f64> {
    let step_s = engine.model().config().step_s;
    let (axis, omega) = (omega.normalize(), omega.length());
    let mut before = omega;
    for k in 1..steps(1.0, step_s) {
        recorder.step(engine, command)?;
        let now = velocity(engine, 0).1.dot(axis);
        if now < 0.1 * omega {
            // Between two steps.
            return Ok((k as f64 - (0.1 * omega - now) / (before - now)) * step_s);
        }
        before = now;
    }
    Ok(0.0)
}

/// Mean distance of the points of a rectangle of these edges from its middle, m.
fn rectangle(a: f64, b: f64) -> f64 {
    let d = (a * a + b * b).sqrt();
    (2.0 * d + a * a / b * libm::asinh(b / a) + b * b / a * libm::asinh(a / b)) / 12.0
}
