//! Faces on faces: hulls of many corners, flush furniture, shapes that touch exactly.

use super::case::{Case, Finding};
use super::scene::{
    G, SceneBuilder, awake, cuboid, fastest, push, set_velocity, settle, tilted, velocity, weightless,
};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "hull_on_ground",
        "prisms of 3 to 64 sides at rest on the endless ground and on a slab",
        hull_on_ground,
    ),
    Case::ours(
        "hull_on_slope",
        "prisms of 3 to 64 sides on slopes up to 0.99 of the critical one",
        hull_on_slope,
    ),
    Case::ours("internal_edges", "a block and a ball over flush slabs, as over one", internal_edges),
    Case::ours(
        "touching_faces",
        "cylinders, boxes and prisms that touch exactly, without weight",
        touching_faces,
    ),
    Case::ours(
        "slow_start",
        "a ball on a slope of 5e-4 and a box 0.01 degrees off its edge, with sleep",
        slow_start,
    ),
];

/// Numbers of sides of the prisms.
const SIDES: [usize; 8] = [3, 4, 5, 6, 8, 12, 20, 64];

/// A prism of n sides, 3 cm in radius and 2 cm high, along z.
fn prism(n: usize) -> Shape {
    let corner = |k: usize| {
        let (s, c) = libm::sincos((k % n) as f64 * TAU / n as f64);
        [0.03 * c, 0.03 * s, if k < n { -0.01 } else { 0.01 }]
    };
    Shape::Hull { points: (0..2 * n).map(corner).collect(), rounding: 0.0 }
}

/// Largest distance of the centre of any prism (0.2 kg) from 10 mm above ground or slab in 5 s, mm; the last
/// speed of any, mm/s, goes to `slip_mm_s`. Exact: m g/(n k), 0.003 mm at most.
pub fn hull_on_ground(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut worst, mut last): (f64, f64) = (0.0, 0.0);
    for n in SIDES {
        for ground in [true, false] {
            let scene = SceneBuilder::new(awake(setup.dt_s))?;
            let scene = if ground { scene.ground(0.5) } else { scene.floor(0.5)? };
            let (mut engine, command) =
                scene.body(prism(n), 0.2, 0.5, Pose::translation(0.0, 0.0, 0.01))?.start(setup)?;
            for _ in 0..steps(5.0, setup.dt_s) {
                recorder.step(&mut *engine, &command)?;
                worst = worst.max((engine.state().objects[0].translation.z - 0.01).abs());
            }
            last = last.max(fastest(&*engine));
        }
    }
    let mut finding = recorder.finding(Figure::new("largest departure from rest", worst * 1e3, "mm"));
    finding.invariants.slip_mm_s = Some(last * 1e3);
    Ok(finding)
}

/// Way of any prism (μ = 0.5) in the last 2 of 4 s on planes of 0.9 and 0.99 of the critical slope, mm. Exact: 0.
pub fn hull_on_slope(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for n in SIDES {
        for part in [0.9, 0.99] {
            for ground in [true, false] {
                let scene = SceneBuilder::new(tilted(awake(setup.dt_s), part * 0.5))?;
                let scene = if ground { scene.ground(0.5) } else { scene.floor(0.5)? };
                let (mut engine, command) =
                    scene.body(prism(n), 0.2, 0.5, Pose::translation(0.0, 0.0, 0.01))?.start(setup)?;
                recorder.steps(&mut *engine, &command, steps(2.0, setup.dt_s))?;
                let before = engine.state().objects[0].translation;
                recorder.steps(&mut *engine, &command, steps(2.0, setup.dt_s))?;
                worst = worst.max(engine.state().objects[0].translation.distance(before));
            }
        }
    }
    Ok(recorder.finding(Figure::new("largest creep in 2 s", worst * 1e3, "mm")))
}

/// Flush slabs, n x n of them, that together are a plate of 2 m whose top is z = 0.
fn slabs(mut scene: SceneBuilder, n: usize) -> Result<SceneBuilder> {
    let size = 2.0 / n as f64;
    for k in 0..n * n {
        let at = |i: usize| -1.0 + (i as f64 + 0.5) * size;
        let pose = Pose::translation(at(k % n), at(k / n), -0.02);
        scene = scene.fixed(&cuboid(size, size, 0.04), pose, 0.3)?;
    }
    Ok(scene)
}

/// Largest relative error, in percent, of: the way of a block pushed with 1.5 μ m g over a seam for 1 s; the
/// way of a block thrown at 2 m/s askew over 1 x 1, 3 x 3 and 7 x 7 flush slabs, `v²/(2 μ g)`; the speed of a
/// ball that rolls at 1 m/s over 7 slabs. Exact: as over one slab.
pub fn internal_edges(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mu, block) = (0.3, || cuboid(0.06, 0.06, 0.04));
    let mut worst: f64 = 0.0;
    let scene = slabs(SceneBuilder::new(awake(setup.dt_s))?, 2)?;
    let start = Pose::translation(-0.035, 0.1, 0.02);
    let (mut engine, command) = scene.body(block(), 0.3, mu, start)?.start(setup)?;
    settle(&mut *engine, &command, 0.3)?;
    let time = 0.8;
    for _ in 0..steps(time, setup.dt_s) {
        push(&mut *engine, 0, Vec3::X * (1.5 * mu * 0.3 * G), Vec3::ZERO);
        recorder.step(&mut *engine, &command)?;
    }
    let way = engine.state().objects[0].translation.x + 0.035;
    worst = worst.max((way / (0.5 * 0.5 * mu * G * time * time) - 1.0).abs());
    for n in [1, 3, 7] {
        let scene = slabs(SceneBuilder::new(awake(setup.dt_s))?, n)?;
        let start = Pose::translation(-0.5, -0.21, 0.02);
        let (mut engine, command) = scene.body(block(), 0.3, mu, start)?.start(setup)?;
        settle(&mut *engine, &command, 0.3)?;
        set_velocity(&mut *engine, 0, Vec3::new(1.9, 0.6245, 0.0), Vec3::ZERO);
        let before = engine.state().objects[0].translation;
        recorder.steps(&mut *engine, &command, steps(1.2, setup.dt_s))?;
        let way = engine.state().objects[0].translation.distance(before);
        worst = worst.max((way / (4.0 / (2.0 * mu * G)) - 1.0).abs());
        let scene = slabs(SceneBuilder::new(awake(setup.dt_s))?, n)?;
        let start = Pose::translation(-0.8, 0.03, 0.03);
        let (mut engine, command) =
            scene.body(Shape::Sphere { radius: 0.03 }, 0.1, mu, start)?.start(setup)?;
        settle(&mut *engine, &command, 0.1)?;
        set_velocity(&mut *engine, 0, Vec3::X, Vec3::Y / 0.03);
        recorder.steps(&mut *engine, &command, steps(1.5, setup.dt_s))?;
        worst = worst.max((velocity(&*engine, 0).0.x - 1.0).abs());
    }
    Ok(recorder.finding(Figure::new("largest error of a way or speed", 100.0 * worst, "%")))
}

/// Largest speed, m/s, in 100 steps, of five bodies in a row that touch exactly: cylinders by their caps and by their
/// sides, boxes, prisms of six sides. Exact: 0.
pub fn touching_faces(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let lying = Rotation::from_rotation_x(FRAC_PI_2);
    let can = || Shape::Cylinder { radius: 0.02, half_length: 0.02 };
    let rows: [(Shape, Rotation, Vec3); 5] = [
        (can(), Rotation::IDENTITY, Vec3::Z * 0.04),
        (can(), lying, Vec3::X * 0.04),
        (cuboid(0.04, 0.04, 0.04), Rotation::IDENTITY, Vec3::Z * 0.04),
        (cuboid(0.04, 0.04, 0.04), Rotation::IDENTITY, Vec3::new(0.04, 0.04, 0.0)),
        (prism(6), Rotation::IDENTITY, Vec3::Z * 0.02),
    ];
    let mut worst: f64 = 0.0;
    for (shape, turn, spacing) in rows {
        let mut scene = SceneBuilder::new(weightless(setup.dt_s))?;
        for k in 0..5 {
            scene = scene.body(shape.clone(), 0.1, 0.5, Pose::from_parts(spacing * f64::from(k), turn))?;
        }
        let (mut engine, command) = scene.start(setup)?;
        for _ in 0..100 {
            recorder.step(&mut *engine, &command)?;
            worst = worst.max(fastest(&*engine));
        }
    }
    Ok(recorder.finding(Figure::new("fastest body", worst, "m/s")))
}

/// Largest relative error, in percent, of the way of a ball down a slope of 5e-4 in 10 s, `5/14 g tan t²` =
/// 0.175 m; 100 if a box tilted by 0.01 degrees off its edge has not fallen after 3 s. Bodies may sleep.
pub fn slow_start(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let sleepy = palmares_sim::Config::with_step(setup.dt_s);
    let (mut engine, command) = SceneBuilder::new(tilted(sleepy.clone(), 5e-4))?
        .ground(0.5)
        .body(Shape::Sphere { radius: 0.03 }, 0.1, 0.5, Pose::translation(0.0, 0.0, 0.03))?
        .start(setup)?;
    recorder.steps(&mut *engine, &command, steps(10.0, setup.dt_s))?;
    let way = engine.state().objects[0].translation.x;
    let mut worst = (way / (5.0 / 14.0 * G * 5e-4 * 100.0) - 1.0).abs();
    let (half, off) = ([0.02, 0.05], 0.01f64.to_radians());
    let (sin, cos) = libm::sincos(off);
    let radius = f64::hypot(half[0], half[1]);
    let turn = Rotation::from_rotation_y(libm::atan2(half[0], half[1]) + off);
    let at = Vec3::new(radius * sin, 0.0, radius * cos);
    let (mut engine, command) = SceneBuilder::new(sleepy)?
        .ground(0.8)
        .body(cuboid(2.0 * half[0], 0.06, 2.0 * half[1]), 0.1, 0.8, Pose::from_parts(at, turn))?
        .start(setup)?;
    recorder.steps(&mut *engine, &command, steps(3.0, setup.dt_s))?;
    if engine.state().objects[0].translation.z > 0.03 {
        worst = 1.0;
    }
    Ok(recorder.finding(Figure::new("error of a way, or of a fall that does not come", 100.0 * worst, "%")))
}
