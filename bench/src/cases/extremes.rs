//! Ends of the ranges: friction of 0 and of 3, bodies of a millimetre and of two metres.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, rigid, set_velocity, settle, tilted, velocity};
use super::setup::{Setup, steps};
use crate::case_report::{Figure, Invariants};
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::{Pose, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("friction_ends", "a plate on slopes without friction and with a friction of 3", friction_ends),
    Case::new("small_and_large", "cubes of 1 mm and of 2 m slide to a stop", small_and_large),
];

/// Largest error of an acceleration, in percent of `g cos θ`, of a plate of 12 x 12 x 2 cm that slides down slopes: tan θ = 0.1 and 1
/// without friction, 1.05 μ for μ = 3. Exact: `g (sin θ − μ cos θ)`. The creep at 0.95 μ for μ = 3 goes to `slip_mm_s`; it is 0.
pub fn friction_ends(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut creep, mut worst): (f64, f64) = (0.0, 0.0);
    for (mu, tan) in [(0.0, 0.1), (0.0, 1.0), (3.0, 0.95 * 3.0), (3.0, 1.05 * 3.0)] {
        let (mut engine, command) = SceneBuilder::new(tilted(awake(setup.dt_s), tan))?
            .ground(mu)
            .body(cuboid(0.12, 0.12, 0.02), 0.5, mu, Pose::translation(0.0, 0.0, 0.01))?
            .start(setup)?;
        settle(&mut *engine, &command, 0.5)?;
        let (place, before) = (engine.state().objects[0].translation, velocity(&*engine, 0).0);
        let count = steps(1.0, setup.dt_s);
        recorder.steps(&mut *engine, &command, count)?;
        let time = count as f64 * setup.dt_s;
        let normal = G / (1.0 + tan * tan).sqrt();
        let gained = (velocity(&*engine, 0).0 - before) / time;
        if tan < mu {
            creep = creep.max((engine.state().objects[0].translation - place).length() / time);
        }
        let exact = Vec3::X * (normal * (tan - mu).max(0.0));
        worst = worst.max((gained - exact).length() / normal);
    }
    let error = Figure::new("largest error of an acceleration", 100.0 * worst, "% of g cos");
    Ok(Finding { error, invariants: Invariants { slip_mm_s: Some(creep * 1e3), ..recorder.invariants() } })
}

/// Friction coefficient of the cubes, their density, kg/m³, and their way, in edges.
const FRICTION: f64 = 0.3;
const DENSITY: f64 = 1000.0;
const WAY: f64 = 20.0;

/// Largest relative error, in percent, of the way `v₀²/(2 μ g)` on which a cube of 1 mm and 1 mg, and one of 2 m and 8 t, stops: 20 of
/// its edges. The contacts of the large one are [`RIGID`](crate::engine::RIGID): the usual ones would let it sink by 0.1 m.
pub fn small_and_large(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for (edge, config) in [(1e-3, awake(setup.dt_s)), (2.0, rigid(setup.dt_s))] {
        let (mut engine, command) = SceneBuilder::new(config)?
            .ground(FRICTION)
            .body(
                cuboid(edge, edge, edge),
                DENSITY * edge.powi(3),
                FRICTION,
                Pose::translation(0.0, 0.0, 0.5 * edge),
            )?
            .start(setup)?;
        settle(&mut *engine, &command, 0.3)?;
        let speed = (2.0 * FRICTION * G * WAY * edge).sqrt();
        set_velocity(&mut *engine, 0, Vec3::X * speed, Vec3::ZERO);
        let start = engine.state().objects[0].translation;
        let time = speed / (FRICTION * G);
        recorder.steps(&mut *engine, &command, steps(1.2 * time + 0.05, setup.dt_s))?;
        let way = engine.state().objects[0].translation.distance(start);
        worst = worst.max((way / (WAY * edge) - 1.0).abs());
    }
    Ok(recorder.finding(Figure::new("error of the way", 100.0 * worst, "%")))
}
