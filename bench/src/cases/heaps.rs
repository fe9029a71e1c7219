//! Many bodies on each other, reported and not gated.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid, rigid};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::random::Random;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "six_cubed",
        "6 x 6 x 6 spheres without friction fall apart for 3 s; how much they overlap",
        six_cubed,
    ),
    Case::new("kapla", "tower of 102 planks in 34 crossed layers stands for 5 s", kapla),
];

/// Mean over steps of the sum of squared overlaps, m², of 216 spheres (10 kg, R = 0.1 m) with centres at 0.21
/// m, each shifted by up to a millimetre. For 3 s they fall on a floor and spread. Exact: none, as rigid
/// spheres; the contacts are [`RIGID`](crate::engine::RIGID), as in `sphere_stack`. Published at 1 ms
/// (SimBenchmark): ODE 1.5e-4, MuJoCo 0.095, Bullet 0.38.
pub fn six_cubed(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (n, radius, spacing) = (6, 0.1, 0.21);
    let mut random = Random::new(6);
    let mut scene = SceneBuilder::new(rigid(setup.dt_s))?.floor(0.0)?;
    for k in 0..n * n * n {
        let cell = Vec3::new(f64::from(k % n), f64::from(k / n % n), f64::from(k / (n * n)));
        let at = cell * spacing + Vec3::new(0.0, 0.0, spacing) + random.cube() * 1e-3;
        scene = scene.body(Shape::Sphere { radius }, 10.0, 0.0, Pose::from_translation(at))?;
    }
    let (mut engine, command) = scene.start(setup)?;
    let count = steps(3.0, setup.dt_s);
    let mut sum = 0.0;
    for _ in 0..count {
        recorder.step(&mut *engine, &command)?;
        sum += overlaps(&*engine, radius);
    }
    Ok(recorder.finding(Figure::new("mean sum of squared overlaps", sum / count as f64, "m^2")))
}

/// Sum of squared overlaps of equal spheres with each other and the floor, m².
fn overlaps(engine: &dyn Engine, radius: f64) -> f64 {
    let places: Vec<Vec3> = engine.state().objects.iter().map(|pose| pose.translation).collect();
    let mut sum = 0.0;
    for (i, a) in places.iter().enumerate() {
        sum += (radius - a.z).max(0.0).powi(2);
        for b in &places[..i] {
            let squared = a.distance_squared(*b);
            if squared < 4.0 * radius * radius {
                sum += (2.0 * radius - squared.sqrt()).powi(2);
            }
        }
    }
    sum
}

/// Displacement, mm, of the top of a tower of 34 crossed layers of three planks (117.5 x 23.5 x 7.8 mm, 13 g,
/// μ = 0.5) after 5 s: 0.02 mm on its springs if it holds, 265 mm high. SimBenchmark waits up to 600 s and
/// reports when it falls.
pub fn kapla(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let [length, width, height] = [0.1175, 0.0235, 0.0078];
    let mut scene = SceneBuilder::new(awake(setup.dt_s))?.floor(0.5)?;
    for layer in 0..34 {
        let turn = Rotation::from_rotation_z(if layer % 2 == 0 { 0.0 } else { std::f64::consts::FRAC_PI_2 });
        for place in -1..=1 {
            let side = turn * Vec3::new(0.0, f64::from(place) * 0.5 * (length - width), 0.0);
            let at = side + Vec3::new(0.0, 0.0, (f64::from(layer) + 0.5) * height);
            scene = scene.body(cuboid(length, width, height), 0.013, 0.5, Pose::from_parts(at, turn))?;
        }
    }
    let (mut engine, command) = scene.start(setup)?;
    let start = engine.state().objects[101].translation;
    recorder.steps(&mut *engine, &command, steps(5.0, setup.dt_s))?;
    let moved = (engine.state().objects[101].translation - start).length();
    Ok(recorder.finding(Figure::new("motion of the top", moved * 1e3, "mm")))
}
