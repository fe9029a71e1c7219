//! Friction's torque about the normal of flat contacts: a rod pinched off its centre of mass, a disc that slides and spins.

use super::case::{Case, Finding};
use super::scene::{G, Scene, awake, cuboid, set_velocity, settle, velocity};
use super::setup::{Setup, steps};
use crate::recorder::Recorder;
use crate::report::Figure;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, HingeKind};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "pinch_tilt_torsion",
        "rod between two round pads: how far from its centre it can be held level",
        pinch_tilt_torsion,
    ),
    Case::ours("patch_spin", "disc, square and fingertip spin to a stop under an even pressure", patch_spin),
    Case::new("disc_contensou", "disc that slides and spins on a plane: both end together", disc_contensou),
];

/// Error, in percent, of the largest distance from its centre of mass at which a rod (0.2 kg) can be pinched with N = 20 N by
/// two round pads (R_c = 1 cm, μ = 0.5) without tilting, against `m g e = 2 · ⅔ μ N R_c`, e = 68 mm, for evenly pressing pads.
/// Whoever presses at the rims alone holds up to 102 mm, half as far again.
pub fn pinch_tilt_torsion(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mass, mu, press, radius) = (0.2, 0.5, 20.0, 0.01);
    let exact = 4.0 / 3.0 * mu * press * radius / (mass * G);
    let (mut low, mut high) = (0.2 * exact, 2.0 * exact);
    while high - low > 0.005 * exact {
        let offset = 0.5 * (low + high);
        if tilts(setup, recorder, [mass, mu, press, radius], offset)? {
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

fn tilts(
    setup: &Setup,
    recorder: &mut Recorder,
    [mass, mu, press, radius]: [f64; 4],
    offset: f64,
) -> Result<bool> {
    let half = 0.01;
    let pad = |link_from_geom| Geom {
        link_from_geom,
        shape: Shape::Cylinder { radius, half_length: 0.005 },
        friction: mu,
    };
    let across = Rotation::from_rotation_y(-FRAC_PI_2);
    let at = |x: f64| Pose::from_parts(Vec3::new(x, 0.0, 0.0), across);
    let finger = Finger {
        kind: HingeKind::Prismatic,
        base_from_hinge: at(half + 0.005),
        mass: 0.05,
        inertia: 1e-5,
        stiffness: 0.0,
        damping: 1.0,
        tension: press,
        geoms: vec![pad(Pose::IDENTITY)],
    };
    let hand = Arc::new(fingers("pads", vec![pad(at(-half - 0.005))], vec![finger])?);
    let (mut engine, mut command) = Scene::with_hand(bolted(awake(setup.dt_s)), hand, Pose::IDENTITY)?
        .body(cuboid(2.0 * half, 0.4, 2.0 * half), mass, mu, Pose::translation(0.0, offset, 0.0))?
        .start(setup)?;
    // The cable is wound far beyond its largest tension, which therefore acts all the time.
    command.sigma[0] = 1.0;
    for _ in 0..steps(0.5, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        if (engine.state().objects[0].rotation * Vec3::Z).z < 0.9994 {
            return Ok(true);
        }
    }
    Ok(false)
}

/// v/(R ω) at the end of a disc (R = 0.05 m, 0.1 kg, μ = 0.3) that starts with v = 0.5 m/s and ω = 10 rad/s, as error in percent of
/// 0.6530, towards which it goes under an even pressure (Farkas et al. 2003, Phys. Rev. Lett. 90, 248302). Ours presses at
/// single points of the rim, for which the answer is another.
pub fn disc_contensou(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let radius = 0.05;
    let disc = Shape::Cylinder { radius, half_length: 0.005 };
    let (mut engine, command) = Scene::new(awake(setup.dt_s))?
        .floor(0.3)?
        .body(disc, 0.1, 0.3, Pose::translation(0.0, 0.0, 0.005))?
        .start(setup)?;
    settle(&mut *engine, &command, 0.5)?;
    set_velocity(&mut *engine, 0, Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, 0.0, 10.0));
    let mut ratio = f64::INFINITY;
    for _ in 0..steps(2.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let (linear, angular) = velocity(&*engine, 0);
        // Until a fiftieth of the speeds is left: what comes after is the deadband's and the anchors'.
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
        let (mut engine, command) = Scene::new(awake(setup.dt_s))?
            .floor(mu)?
            .body(shape, 0.1, mu, Pose::translation(0.0, 0.0, 0.005))?
            .start(setup)?;
        settle(&mut *engine, &command, 0.3)?;
        set_velocity(&mut *engine, 0, Vec3::ZERO, Vec3::new(0.0, 0.0, omega));
        let exact = 0.9 * gyration * omega / (mu * G * radius);
        let (mut time, mut before) = (0.0, omega);
        for k in 1..steps(1.0, setup.dt_s) {
            recorder.step(&mut *engine, &command)?;
            let now = velocity(&*engine, 0).1.z;
            if now < 0.1 * omega {
                // Between two steps.
                time = (k as f64 - (0.1 * omega - now) / (before - now)) * setup.dt_s;
                break;
            }
            before = now;
        }
        worst = worst.max((time / exact - 1.0).abs());
    }
    Ok(recorder.finding(Figure::new("largest error of the time", 100.0 * worst, "%")))
}

/// Mean distance of the points of a rectangle of these edges from its middle, m.
fn rectangle(a: f64, b: f64) -> f64 {
    let d = (a * a + b * b).sqrt();
    (2.0 * d + a * a / b * libm::asinh(b / a) + b * b / a * libm::asinh(a / b)) / 12.0
}
