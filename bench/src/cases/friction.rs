//! Sliding and sticking on furniture, with textbook answers.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, push, set_velocity, settle, tilted, velocity};
use super::setup::{Setup, steps};
use crate::case_report::{Figure, Invariants};
use crate::recorder::Recorder;
use anyhow::{Result, ensure};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Vec3};
use palmares_sim::Config;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "incline_critical",
        "block on slopes of 0.9 and 0.99 mu (creep), 1.01 and 1.2 mu (acceleration), in three headings",
        incline_critical,
    ),
    Case::new(
        "slide_stop",
        "cube thrown along a floor in three directions stops after v0^2/(2 mu g)",
        slide_stop,
    ),
    Case::new(
        "tip_or_slide",
        "slopes and pushes at which a box tips or slides, found by bisection",
        tip_or_slide,
    ),
    Case::new(
        "bead_between_plates",
        "bead that cannot turn, pushed along a gap hardly wider than itself",
        bead_between_plates,
    ),
];

/// Headings against the axes of cube and contact tangents: a friction pyramid shows at those between.
const HEADINGS: [f64; 3] = [0.0, 22.5, 45.0];

fn heading(degrees: f64) -> (f64, f64) {
    degrees.to_radians().sin_cos()
}

/// Gravity of a slope that falls towards a heading.
fn slope(dt_s: f64, tan: f64, degrees: f64) -> Config {
    let config = tilted(awake(dt_s), tan);
    let (sin, cos) = heading(degrees);
    let gravity = Vec3::new(config.gravity.x * cos, config.gravity.x * sin, config.gravity.z);
    Config { gravity, ..config }
}

/// Largest error of the sliding acceleration at tan θ = 1.01 μ and 1.2 μ over three headings, in percent of
/// the deceleration by friction, `μ g cos θ`; the fastest creep at 0.9 μ and 0.99 μ over 10 s goes to
/// `slip_mm_s`. Exact: `a = g (sin θ − μ cos θ)` downhill, and rest. Regularised stiction creeps with σ μ h g
/// (0.005 mm/s at 1 ms and σ = 10⁻³; Castro, Permenter, Han 2022).
pub fn incline_critical(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mu = 0.5;
    let at = Pose::translation(0.0, 0.0, 0.03);
    let block = |ratio: f64, degrees: f64| {
        SceneBuilder::new(slope(setup.dt_s, ratio * mu, degrees))?
            .floor(mu)?
            .body(cuboid(0.06, 0.06, 0.06), 0.5, mu, at)?
            .start(setup)
    };
    let (mut creep, mut worst): (f64, f64) = (0.0, 0.0);
    for degrees in HEADINGS {
        for ratio in [0.9, 0.99] {
            let (mut engine, command) = block(ratio, degrees)?;
            // The first second loads the anchor; the rest is creep.
            recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
            let start = engine.state().objects[0].translation;
            recorder.steps(&mut *engine, &command, steps(10.0, setup.dt_s))?;
            creep = creep.max((engine.state().objects[0].translation - start).length() / 10.0);
        }
        for ratio in [1.01, 1.2] {
            let (mut engine, command) = block(ratio, degrees)?;
            let (sin, cos) = heading(degrees);
            let tan = ratio * mu;
            let normal = G / (1.0 + tan * tan).sqrt();
            let exact = Vec3::new(cos, sin, 0.0) * (normal * (tan - mu));
            recorder.steps(&mut *engine, &command, steps(0.5, setup.dt_s))?;
            let before = velocity(&*engine, 0).0;
            let count = steps(1.0, setup.dt_s);
            recorder.steps(&mut *engine, &command, count)?;
            let gained = (velocity(&*engine, 0).0 - before) / (count as f64 * setup.dt_s);
            worst = worst.max((gained - exact).length() / (mu * normal));
        }
    }
    let error = Figure::new("acceleration error", 100.0 * worst, "% of mu g");
    Ok(Finding { error, invariants: Invariants { slip_mm_s: Some(creep * 1e3), ..recorder.invariants() } })
}

/// Largest relative error of the stopping distance v₀²/(2 μ g) over three headings, in percent; the
/// sideways deviation counts as well. After ContactBench (Le Lidec et al. 2023, arXiv:2304.06372).
pub fn slide_stop(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mu, v0) = (0.4, 1.0);
    let exact = v0 * v0 / (2.0 * mu * G);
    let mut worst: f64 = 0.0;
    for degrees in HEADINGS {
        let (sin, cos) = heading(degrees);
        let direction = Vec3::new(cos, sin, 0.0);
        let at = Pose::translation(0.0, 0.0, 0.1);
        let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
            .floor(mu)?
            .body(cuboid(0.2, 0.2, 0.2), 1.0, mu, at)?
            .start(setup)?;
        // It starts settled: half a millimetre of sinking while sliding would be an error of the start.
        settle(&mut *engine, &command, 0.5)?;
        let start = engine.state().objects[0].translation;
        set_velocity(&mut *engine, 0, direction * v0, Vec3::ZERO);
        recorder.steps(&mut *engine, &command, steps(0.5, setup.dt_s))?;
        let travelled = engine.state().objects[0].translation - start;
        let flat = Vec3::new(travelled.x, travelled.y, 0.0);
        worst = worst.max((flat - direction * exact).length() / exact);
    }
    Ok(recorder.finding(Figure::new("stopping distance error", 100.0 * worst, "%")))
}

/// The load on a box.
#[derive(Clone, Copy, Debug)]
enum Ask {
    /// A slope of this tan θ.
    Slope(f64),
    /// A push with a force, N, at a height, m.
    Push(f64, f64),
}

/// Whether a box of b = 0.1 m and h = 0.2 m moves within two seconds; an error if it slides instead of
/// tipping, or the other way round.
fn moves(setup: &Setup, recorder: &mut Recorder, mu: f64, ask: Ask, should_tip: bool) -> Result<bool> {
    let (b, height, mass) = (0.1, 0.2, 1.0);
    let tan = if let Ask::Slope(tan) = ask { tan } else { 0.0 };
    let (mut engine, command) = SceneBuilder::new(tilted(awake(setup.dt_s), tan))?
        .floor(mu)?
        .body(cuboid(b, b, height), mass, mu, Pose::translation(0.0, 0.0, 0.5 * height))?
        .start(setup)?;
    for k in 0..steps(2.0, setup.dt_s) {
        // The push grows over half a second, and the slope's pull is held back as long, so that the start
        // causes no slip.
        let grown = (k as f64 * setup.dt_s / 0.5).min(1.0);
        let (force, z) = match ask {
            Ask::Slope(_) => (-mass * engine.model().config().gravity.x * (1.0 - grown), 0.5 * height),
            Ask::Push(force, z) => (force * grown, z),
        };
        push(&mut *engine, 0, Vec3::new(force, 0.0, 0.0), Vec3::new(0.0, 0.0, z - 0.5 * height));
        recorder.step(&mut *engine, &command)?;
        let pose = engine.state().objects[0];
        let foot = pose.transform_point(Vec3::new(0.5 * b, 0.0, -0.5 * height)).x - 0.5 * b;
        let tipped = (pose.rotation * Vec3::Z).z < 0.98;
        if tipped || foot > 2e-3 {
            ensure!(tipped == should_tip, "at {ask:?} the box {}", if tipped { "tips" } else { "slides" });
            return Ok(true);
        }
    }
    Ok(false)
}

/// The load at which a box begins to move, by bisection to half a part in a thousand.
fn threshold(mut moves: impl FnMut(f64) -> Result<bool>, around: f64) -> Result<f64> {
    let (mut low, mut high) = (0.9 * around, 1.1 * around);
    while high - low > 1e-3 * around {
        let middle = 0.5 * (low + high);
        if moves(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(0.5 * (low + high))
}

/// Largest relative error of four thresholds, in percent, for a box b wide and h high. On a slope it tips from
/// tan θ = b/h if that is below μ, else it slides from tan θ = μ. Pushed at height z it tips from
/// `F = m g b/(2 z)` if that is below μ m g, else it slides from `F = μ m g`.
pub fn tip_or_slide(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for (mu, exact, tips) in [(0.8, 0.5, true), (0.4, 0.4, false)] {
        let found = threshold(|tan| moves(setup, recorder, mu, Ask::Slope(tan), tips), exact)?;
        worst = worst.max((found / exact - 1.0).abs());
    }
    for (mu, z, exact, tips) in [(0.6, 0.16, G * 0.1 / 0.32, true), (0.4, 0.05, 0.4 * G, false)] {
        let found = threshold(|force| moves(setup, recorder, mu, Ask::Push(force, z), tips), exact)?;
        worst = worst.max((found / exact - 1.0).abs());
    }
    Ok(recorder.finding(Figure::new("threshold error", 100.0 * worst, "%")))
}

/// Largest distance from `x = (u/m − μ g) t²/2` within 0.5 s, in percent of the way, of a bead (r = 0.05 m, 0.2 kg, μ =
/// 0.3) that is pushed with u = 1 N between planes 51 mm off its axis and may not turn: its inertia is a thousand kg m²
/// (Horak & Trinkle 2019, analytic_bead.m of erwincoumans/contact_models).
pub fn bead_between_plates(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mu, mass, radius, u) = (0.3, 0.2, 0.05, 1.0);
    let plate = cuboid(10.0, 10.0, 0.1);
    let mut bead = Object::new("bead", vec![(Pose::IDENTITY, Shape::Sphere { radius })], mass, mu, 0.0)?;
    bead.inertia = Mat3::from_diagonal(Vec3::splat(1e3));
    let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
        .fixed(&plate, Pose::translation(0.0, 0.0, -0.05), mu)?
        .fixed(&plate, Pose::translation(0.0, 0.0, 2.0 * 0.051 + 0.05), mu)?
        .object(bead, Pose::translation(0.0, 0.0, radius))?
        .start(setup)?;
    // Settled first: its own weight presses it 10 µm into the floor.
    settle(&mut *engine, &command, 0.5)?;
    let start = engine.state().objects[0].translation.x;
    let mut worst: f64 = 0.0;
    let acceleration = u / mass - mu * G;
    let count = steps(0.5, setup.dt_s);
    for k in 0..count {
        push(&mut *engine, 0, Vec3::new(u, 0.0, 0.0), Vec3::ZERO);
        recorder.step(&mut *engine, &command)?;
        let t = (k + 1) as f64 * setup.dt_s;
        let x = engine.state().objects[0].translation.x - start;
        worst = worst.max((x - 0.5 * acceleration * t * t).abs());
    }
    let way = 0.5 * acceleration * 0.25;
    Ok(recorder.finding(Figure::new("distance error", 100.0 * worst / way, "%")))
}
