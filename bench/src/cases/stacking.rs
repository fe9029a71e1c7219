//! Bodies at rest on each other: depth, forces, and heavy bodies on light ones.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, push, rigid};
use super::setup::{Setup, ends_of_steps, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Config, Owner};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "rest_penetration",
        "sphere and box at rest sink m g/k into the floor, with a steady force",
        rest_penetration,
    ),
    Case::new("mass_ratio", "cube on a cube up to a million times lighter, at rest and dragged", mass_ratio),
    Case::new(
        "sphere_stack",
        "columns of 1 to 15 spheres stand, and every contact carries what is above it",
        sphere_stack,
    ),
];

/// Force between two bodies in the last step, on the one with the higher number, N; zero if they do not
/// touch, none if the engine does not report forces.
pub(crate) fn force_between(engine: &dyn Engine, a: Owner, b: Owner) -> Option<Vec3> {
    let mut sum = Vec3::ZERO;
    for contact in engine.world()?.contact_forces() {
        if (contact.a, contact.b) == (a, b) {
            sum += contact.force;
        } else if (contact.a, contact.b) == (b, a) {
            sum -= contact.force;
        }
    }
    Some(sum)
}

/// Largest relative error of the depth at rest, in percent: m g/k for a sphere, m g/(4 k) for a box, over masses of 10 g
/// to 5 kg. The largest error of the contact force over the last half second goes to `force_error_percent`.
pub fn rest_penetration(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut worst, mut wrong): (f64, f64) = (0.0, 0.0);
    for mass in [0.01, 0.1, 1.0, 5.0] {
        let side = 0.05;
        for (shape, points) in [(Shape::Sphere { radius: 0.5 * side }, 1.0), (cuboid(side, side, side), 4.0)]
        {
            let config = awake(setup.dt_s);
            let exact = mass * G / (points * config.contact_stiffness);
            let (mut engine, command) = SceneBuilder::new(config)?
                .floor(0.5)?
                .body(shape, mass, 0.5, Pose::translation(0.0, 0.0, 0.5 * side))?
                .start(setup)?;
            for t in ends_of_steps(2.0, setup.dt_s) {
                recorder.step(&mut *engine, &command)?;
                if t > 1.5 {
                    let force = force_between(&*engine, Owner::Static, Owner::Object(0));
                    wrong = wrong.max(force.map_or(0.0, |f| (f.z / (mass * G) - 1.0).abs()));
                }
            }
            let depth = 0.5 * side - engine.state().objects[0].translation.z;
            worst = worst.max((depth / exact - 1.0).abs());
        }
    }
    let error = Figure::new("depth error", 100.0 * worst, "%");
    Ok(recorder.finding(error).with_force_error(wrong))
}

/// Error of the dragged cubes: the largest way, in mm, that the upper cube (0.2 m, √r kg) moved on the lower
/// one (0.2 m, 1/√r kg), over r = 1 … 10⁶: for 1 s at rest, then 1 s dragged with half of `μ m₂ g`. Exact: no
/// motion. The largest error of the two contact forces, `(m₁ + m₂) g` and `m₂ g`, goes to
/// `force_error_percent`. After ContactBench (Le Lidec et al. 2023, arXiv:2304.06372), where per-contact
/// solvers fail from 10⁶ on. The contacts are stiff in proportion to the load, so that a ton sinks no deeper
/// than a kilogram.
pub fn mass_ratio(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut moved, mut wrong): (f64, f64) = (0.0, 0.0);
    let side = 0.2;
    for decade in 0..=6 {
        let heavy = 10f64.powf(0.5 * f64::from(decade));
        let light = 1.0 / heavy;
        let plain = awake(setup.dt_s);
        let config = Config {
            contact_stiffness: plain.contact_stiffness * heavy,
            anchor_stiffness: plain.anchor_stiffness * heavy,
            ..plain
        };
        let cube = || cuboid(side, side, side);
        let (mut engine, command) = SceneBuilder::new(config)?
            .floor(0.9)?
            .body(cube(), light, 0.9, Pose::translation(0.0, 0.0, 0.5 * side))?
            .body(cube(), heavy, 0.9, Pose::translation(0.0, 0.0, 1.5 * side))?
            .start(setup)?;
        recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
        let (a, b, c) = (Owner::Static, Owner::Object(0), Owner::Object(1));
        for (force, exact) in
            [(force_between(&*engine, a, b), (light + heavy) * G), (force_between(&*engine, b, c), heavy * G)]
        {
            wrong = wrong.max(force.map_or(0.0, |f| (f.z / exact - 1.0).abs()));
        }
        let start = [0, 1].map(|k| engine.state().objects[k].translation);
        let drag = 0.5 * 0.9 * heavy * G;
        let count = steps(1.0, setup.dt_s);
        for k in 0..count {
            let now = drag * (2.0 * k as f64 / count as f64).min(1.0);
            push(&mut *engine, 1, Vec3::new(now, 0.0, 0.0), Vec3::new(0.0, 0.0, -0.5 * side));
            recorder.step(&mut *engine, &command)?;
        }
        for k in 0..2 {
            moved = moved.max((engine.state().objects[k].translation - start[k]).length());
        }
    }
    let error = Figure::new("largest motion of a cube", moved * 1e3, "mm");
    Ok(recorder.finding(error).with_force_error(wrong))
}

/// Deepest overlap, mm, in columns of n = 1 … 15 spheres (r = 0.05 m, 0.2 kg, μ = 0.3) after 1 s (Horak &
/// Trinkle 2019). Exact: none, as rigid spheres. The scene sets the stiffness of contacts, not the solver:
/// here rigid bodies ([`RIGID`](crate::engine::RIGID)) instead of pads. Ours sink `n m g/k` at the bottom,
/// rapier's are as hard as its sub-steps resolve, and MuJoCo's those of all cases: with harder ones the
/// columns still move after the second, and overlap by far more. The largest relative error of a contact
/// force at the end, `(n − k + 1) m g`, goes to `force_error_percent`.
pub fn sphere_stack(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, mass) = (0.05, 0.2);
    let (mut deepest, mut wrong): (f64, f64) = (0.0, 0.0);
    for n in 1..=15 {
        let mut scene = SceneBuilder::new(rigid(setup.dt_s))?.floor(0.3)?;
        for k in 0..n {
            let z = (2.0 * f64::from(k) + 1.0) * radius;
            scene = scene.body(Shape::Sphere { radius }, mass, 0.3, Pose::translation(0.0, 0.0, z))?;
        }
        let (mut engine, command) = scene.start(setup)?;
        recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
        let mut below = 0.0;
        for k in 0..n as usize {
            let under = if k == 0 { Owner::Static } else { Owner::Object(k - 1) };
            let exact = (n as usize - k) as f64 * mass * G;
            let force = force_between(&*engine, under, Owner::Object(k));
            wrong = wrong.max(force.map_or(0.0, |f| (f.z / exact - 1.0).abs()));
            let z = engine.state().objects[k].translation.z;
            deepest = deepest.max(below + if k == 0 { radius } else { 2.0 * radius } - z);
            below = z;
        }
    }
    let error = Figure::new("deepest overlap", deepest * 1e3, "mm");
    Ok(recorder.finding(error).with_force_error(wrong))
}
