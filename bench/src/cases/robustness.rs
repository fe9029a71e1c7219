//! Scenes that break simulators: deep overlaps, heavy on light, fast spin, wedges, paradoxes.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid, fastest, push, rigid, set_velocity, velocity, weightless};
use super::setup::{Setup, steps};
use crate::audit::{Audit, mechanical};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Config;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "deep_overlap",
        "bodies that start half inside each other, a wall or the floor part slowly",
        deep_overlap,
    ),
    Case::new("heavy_on_grams", "5 kg slab on four bodies of a gram, balls and cubes", heavy_on_grams),
    Case::ours(
        "spin_and_tumble",
        "three fast spinning boxes in a closed chamber without friction and gravity gain no energy",
        spin_and_tumble,
    ),
    Case::new(
        "wedged_box",
        "box pushed along a gap as wide as itself, between planes of friction 0.9",
        wedged_box,
    ),
    Case::new("painleve_rod", "rod sliding on its tip where rigid bodies have no solution", painleve_rod),
];

/// Fastest body, m/s, within a second in which bodies that start in each other separate: spheres and boxes by
/// half their size, a capsule across a cylinder, a sphere and a box half in the floor, a box in a corner of
/// walls. Nothing else moves them but, in the floor's scenes, their weight. Such a start has no intended
/// speed: ours separate at 0.2 m/s, and a heavy body that turns also moves a light one. More than 1 m/s would
/// be an explosion.
pub fn deep_overlap(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let at = Pose::translation;
    let ball = || Shape::Sphere { radius: 0.05 };
    let block = || cuboid(0.1, 0.1, 0.1);
    let space = || SceneBuilder::new(weightless(setup.dt_s));
    let turned = Pose::from_parts(Vec3::new(0.01, 0.02, 0.015), Rotation::from_rotation_y(1.5));
    let wall = |x: f64| at(x, 0.0, 0.0);
    let scenes = [
        space()?.body(ball(), 1.0, 0.5, at(0.0, 0.0, 0.0))?.body(ball(), 1.0, 0.5, at(0.05, 0.0, 0.0))?,
        space()?.body(block(), 1.0, 0.5, at(0.0, 0.0, 0.0))?.body(block(), 1.0, 0.5, at(0.05, 0.01, 0.02))?,
        space()?.body(block(), 5.0, 0.5, at(0.0, 0.0, 0.0))?.body(ball(), 0.05, 0.5, at(0.05, 0.01, 0.02))?,
        space()?.body(Shape::Capsule { radius: 0.02, half_length: 0.05 }, 0.2, 0.5, turned)?.body(
            Shape::Cylinder { radius: 0.03, half_length: 0.05 },
            0.5,
            0.5,
            at(0.0, 0.0, 0.0),
        )?,
        SceneBuilder::new(awake(setup.dt_s))?.floor(0.5)?.body(ball(), 1.0, 0.5, at(0.0, 0.0, 0.0))?,
        SceneBuilder::new(awake(setup.dt_s))?.floor(0.5)?.body(block(), 0.1, 0.5, at(0.0, 0.0, 0.0))?,
        SceneBuilder::new(awake(setup.dt_s))?
            .floor(0.5)?
            .fixed(&cuboid(0.1, 2.0, 2.0), wall(-0.05), 0.5)?
            .body(block(), 1.0, 0.5, at(0.01, 0.0, 0.03))?,
    ];
    let mut worst: f64 = 0.0;
    for scene in scenes {
        let (mut engine, command) = scene.start(setup)?;
        for _ in 0..steps(1.0, setup.dt_s) {
            recorder.step(&mut *engine, &command)?;
            worst = worst.max(fastest(&*engine));
        }
        // They must also separate: no deeper in each other than a contact at rest.
        anyhow::ensure!(engine.outcome().penetration_m < 1e-3, "they are still in each other");
    }
    let error = Figure::bounded("fastest body", worst, "m/s", 1.0);
    Ok(recorder.finding(error))
}

/// Deepest overlap, mm, after 2 s of a slab of 5 kg on four spheres of a gram (r = 1 cm), then on four cubes
/// of a gram. Exact: none, as rigid bodies; the contacts are [`RIGID`](crate::engine::RIGID). Ours sink by m
/// g/(4 k) = 12 nm under the balls and a quarter of it under the cubes, at any step; MuJoCo's keep the
/// stiffness of all cases.
pub fn heavy_on_grams(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut deepest: f64 = 0.0;
    for shape in [Shape::Sphere { radius: 0.01 }, cuboid(0.02, 0.02, 0.02)] {
        let mut scene = SceneBuilder::new(rigid(setup.dt_s))?.floor(0.5)?;
        for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
            scene = scene.body(shape.clone(), 1e-3, 0.5, Pose::translation(0.06 * x, 0.06 * y, 0.01))?;
        }
        let slab = cuboid(0.16, 0.16, 0.02);
        let (mut engine, command) =
            scene.body(slab, 5.0, 0.5, Pose::translation(0.0, 0.0, 0.03))?.start(setup)?;
        recorder.steps(&mut *engine, &command, steps(2.0, setup.dt_s))?;
        deepest = deepest.max(engine.outcome().penetration_m);
        anyhow::ensure!(engine.state().objects[4].translation.z > 0.029, "the slab has come down");
    }
    Ok(recorder.finding(Figure::new("deepest overlap at rest", deepest * 1e3, "mm")))
}

/// Largest rise of kinetic energy, in percent of the start, of three boxes that spin with 20 rad/s about their middle axes
/// and drift in a chamber without friction and gravity for 5 s. Impacts may take energy, nothing may give any.
pub fn spin_and_tumble(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut scene = SceneBuilder::new(weightless(setup.dt_s))?;
    let (w, t) = (0.15, 0.1);
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let (mut place, mut size) = ([0.0; 3], [2.0 * w + 4.0 * t; 3]);
            (place[axis], size[axis]) = (side * (w + t), 2.0 * t);
            scene = scene.fixed(
                &cuboid(size[0], size[1], size[2]),
                Pose::from_translation(Vec3::from_array(place)),
                0.0,
            )?;
        }
    }
    for x in [-0.1, 0.0, 0.1] {
        scene = scene.body(cuboid(0.02, 0.06, 0.1), 0.3, 0.0, Pose::translation(x, 0.01 * x, -x))?;
    }
    let (mut engine, command) = scene.start(setup)?;
    for k in 0..3 {
        let linear = Vec3::new(0.3, -0.2, 0.1) * (k as f64 - 1.0);
        set_velocity(&mut *engine, k, linear, Vec3::new(0.5, 20.0, 0.3));
    }
    let start = mechanical(&*engine);
    let mut audit = Audit::default();
    for _ in 0..steps(5.0, setup.dt_s) {
        audit.step(&mut *engine, |engine| recorder.step(engine, &command))?;
    }
    let error = Figure::new("rise of energy", 100.0 * audit.gain_j() / start, "%");
    Ok(recorder.finding(error).with_energy_gain(audit.gain_j()))
}

/// Largest displacement, mm, in 1 s of a box of 2 x 2 x 4 cm that is tilted between planes at a distance of
/// 4.2 cm (μ = 0.9), an edge on each, and pushed with 2 N at 1.5 cm off its centre, so that the push wedges
/// it. The line between the edges is 20° off the normal and the friction cone 42°: it does not move, though
/// the force of the wedging is open (Horak & Trinkle 2019, exp_wedging.m). Its contact springs yield some µm.
pub fn wedged_box(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (hx, hz, half_gap) = (0.01f64, 0.02f64, 0.021);
    let tilt = hx.atan2(hz) - (half_gap / hx.hypot(hz)).acos();
    let plane = cuboid(1.0, 1.0, 0.1);
    let (mut engine, command) = SceneBuilder::new(weightless(setup.dt_s))?
        .fixed(&plane, Pose::translation(0.0, 0.0, half_gap + 0.05), 0.9)?
        .fixed(&plane, Pose::translation(0.0, 0.0, -half_gap - 0.05), 0.9)?
        .body(
            cuboid(2.0 * hx, 2.0 * hx, 2.0 * hz),
            0.1,
            0.9,
            Pose::from_parts(Vec3::ZERO, Rotation::from_rotation_y(tilt)),
        )?
        .start(setup)?;
    let mut moved: f64 = 0.0;
    for k in 0..steps(1.0, setup.dt_s) {
        let grown = (k as f64 * setup.dt_s / 0.1).min(1.0);
        push(&mut *engine, 0, Vec3::new(2.0 * grown, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.015));
        recorder.step(&mut *engine, &command)?;
        moved = moved.max(engine.state().objects[0].translation.length());
    }
    Ok(recorder.finding(Figure::new("largest motion", moved * 1e3, "mm")))
}

/// Impulse on the rod, N s, in the 50 ms after its tip begins to slide at 3 m/s; the larger of μ = 5/3 and
/// 1.3. Half length 1 m, 1 kg, g = 10 m/s² (Glocker 1995). It leans by p = 0.9 rad over the tip that leads:
/// with `1 + 3 cos p (cos p − μ sin p) < 0` (μ > 1.48 here) friction drives the tip into the ground and rigid
/// bodies have no solution without an impact. For every step no energy is gained (`energy_gain_j`) and the
/// impulse stays bounded: to stop the tip takes less than m v = 3 N s, and to throw the rod over twice that.
pub fn painleve_rod(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (lean, radius, v, g) = (0.9f64, 0.01, 3.0, 10.0);
    let (mut most, mut gain): (f64, f64) = (0.0, 0.0);
    for mu in [5.0 / 3.0, 1.3] {
        let config = Config { gravity: Vec3::new(0.0, 0.0, -g), ..awake(setup.dt_s) };
        let rod = Shape::Capsule { radius, half_length: 1.0 };
        let turn = Rotation::from_rotation_y(std::f64::consts::FRAC_PI_2 - lean);
        let sunk = g / config.contact_stiffness;
        let center = Vec3::new(lean.cos(), 0.0, lean.sin() + radius - sunk);
        let (mut engine, command) = SceneBuilder::new(config)?
            .floor(mu)?
            .body(rod, 1.0, mu, Pose::from_parts(center, turn))?
            .start(setup)?;
        set_velocity(&mut *engine, 0, Vec3::new(-v, 0.0, 0.0), Vec3::ZERO);
        let mut audit = Audit::default();
        let mut impulse = Vec3::ZERO;
        for k in 0..steps(2.0, setup.dt_s) {
            let before = velocity(&*engine, 0).0;
            audit.step(&mut *engine, |engine| recorder.step(engine, &command))?;
            if k as f64 * setup.dt_s < 0.05 {
                impulse += velocity(&*engine, 0).0 - before + Vec3::new(0.0, 0.0, g * setup.dt_s);
            }
        }
        most = most.max(impulse.length());
        gain = gain.max(audit.gain_j());
    }
    let error = Figure::bounded("impulse", most, "N s", v);
    Ok(recorder.finding(error).with_energy_gain(gain))
}
