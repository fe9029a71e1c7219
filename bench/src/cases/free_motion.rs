//! Bodies that nothing touches: flight and torque-free rotation.
//!
//! The box is that of Peters and Hsu, "Comparison of rigid body dynamic simulators for robotic simulation in
//! Gazebo" (ROSCon 2014; scpeters/benchmark): 0.1 x 0.4 x 0.9 m, 10 kg.

use super::case::{Case, Finding};
use super::elliptic::{complete, incomplete};
use super::scene::{SceneBuilder, cuboid, kinetic, set_velocity, spin, velocity, weightless};
use super::setup::{Setup, ends_of_steps, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, Config};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("free_flight", "10 kg box thrown for 10 s against the parabola", free_flight),
    Case::new("box_tumble", "box spun about its middle axis for 10 s keeps its angular momentum", box_tumble),
    Case::new(
        "box_simple",
        "box drifting and turning about a principal axis for 10 s against the exact pose",
        box_simple,
    ),
    Case::new(
        "box_flip",
        "times at which the tumbling box flips, against Jacobi's elliptic functions",
        box_flip,
    ),
    Case::new("symmetric_top", "rate at which a torque-free cylinder precesses", symmetric_top),
];

/// The tumbling box: about the middle axis, slightly off, rad/s.
const TUMBLE: Vec3 = Vec3::new(0.1, 5.0, 0.1);

fn thrown(setup: &Setup, config: Config, linear: Vec3, angular: Vec3) -> Result<(Box<dyn Engine>, Command)> {
    let (mut engine, command) =
        SceneBuilder::new(config)?.body(cuboid(0.1, 0.4, 0.9), 10.0, 0.5, Pose::IDENTITY)?.start(setup)?;
    set_velocity(&mut *engine, 0, linear, angular);
    Ok((engine, command))
}

/// Largest distance from `v₀ t + g t²/2` in 10 s, v₀ = (−2, 2, 8) m/s, g = 9.8 m/s². Semi-implicit Euler is
/// off by g T h/2 (49 mm at 1 ms: ODE and Bullet), Simbody by half of it (Peters & Hsu).
pub fn free_flight(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let gravity = Vec3::new(0.0, 0.0, -9.8);
    let v0 = Vec3::new(-2.0, 2.0, 8.0);
    let config = Config { gravity, ..weightless(setup.dt_s) };
    let (mut engine, command) = thrown(setup, config, v0, Vec3::ZERO)?;
    let mut worst: f64 = 0.0;
    for t in ends_of_steps(10.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        worst =
            worst.max((engine.state().objects[0].translation - v0 * t - gravity * (0.5 * t * t)).length());
    }
    Ok(recorder.finding(Figure::new("distance from the parabola", worst * 1e3, "mm")))
}

/// Largest |ΔL|/|L₀| in 10 s of the box with ω₀ = (0.1, 5, 0.1) rad/s and no gravity; |ΔE| goes to
/// `energy_gain_j`. Exact: both are constant. Published at 1 ms (Peters & Hsu): ΔL Simbody 0.0064, Bullet
/// 0.0125, ODE 0.0131, DART 2.19 kg m²/s of 3.4; ΔE 0.0062, 0.0136, 0.0125, 0.0376 J.
pub fn box_tumble(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut engine, command) = thrown(setup, weightless(setup.dt_s), Vec3::ZERO, TUMBLE)?;
    let (momentum, energy) = (spin(&*engine, 0), kinetic(&*engine, 0));
    let (mut lost, mut gain): (f64, f64) = (0.0, 0.0);
    for _ in 0..steps(10.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        lost = lost.max((spin(&*engine, 0) - momentum).length() / momentum.length());
        gain = gain.max((kinetic(&*engine, 0) - energy).abs());
    }
    let error = Figure::new("change of angular momentum", lost, "of |L|");
    Ok(recorder.finding(error).with_energy_gain(gain))
}

/// Distance of a corner of the box from its exact place after 10 s with v = (−0.9, 0.4, 0.1) m/s and ω =
/// (0.5, 0, 0) rad/s about a principal axis, no gravity: `x = v t`, turned by ω t. The "simple" case of
/// Peters & Hsu.
pub fn box_simple(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (v, w) = (Vec3::new(-0.9, 0.4, 0.1), 0.5);
    let (mut engine, command) = thrown(setup, weightless(setup.dt_s), v, Vec3::new(w, 0.0, 0.0))?;
    let count = steps(10.0, setup.dt_s);
    recorder.steps(&mut *engine, &command, count)?;
    let t = count as f64 * setup.dt_s;
    let corner = Vec3::new(0.05, 0.2, 0.45);
    let (sin, cos) = (w * t).sin_cos();
    let turned = Vec3::new(corner.x, cos * corner.y - sin * corner.z, sin * corner.y + cos * corner.z);
    let error = (engine.state().objects[0].transform_point(corner) - v * t - turned).length();
    Ok(recorder.finding(Figure::new("distance of a corner", error * 1e3, "mm")))
}

/// Largest relative error of the times at which the tumbling box's middle angular velocity changes sign in
/// 10 s. Exact, with I₁ < I₂ < I₃ and L² > 2 E I₂ (Landau & Lifshitz, Mechanics, § 37): ω₂ is proportional to
/// sn(λ t), `λ² = (I₃ − I₂)(L² − 2 E I₁)/(I₁ I₂ I₃)`, `k² = (I₂ − I₁)(2 E I₃ − L²)/((I₃ − I₂)(L² − 2 E I₁))`,
/// with a period of 4 K(k)/λ.
pub fn box_flip(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut engine, command) = thrown(setup, weightless(setup.dt_s), Vec3::ZERO, TUMBLE)?;
    // The box's z is its axis of least inertia, then y, then x: (z, y, x) is left-handed, which only turns the
    // sign of time, and the flips are counted from where ω₂ has its start value and falls.
    let inertia = engine.model().objects()[0].inertia;
    let (i1, i2, i3) = (inertia.z_axis.z, inertia.y_axis.y, inertia.x_axis.x);
    let (twice_energy, squared) = (2.0 * kinetic(&*engine, 0), spin(&*engine, 0).length_squared());
    let (over, under) = (squared - twice_energy * i1, twice_energy * i3 - squared);
    let lambda = ((i3 - i2) * over / (i1 * i2 * i3)).sqrt();
    let modulus = ((i2 - i1) * under / ((i3 - i2) * over)).sqrt();
    let amplitude = (under / (i2 * (i3 - i2))).sqrt();
    let (half_period, since_zero) =
        (2.0 * complete(modulus) / lambda, incomplete((TUMBLE.y / amplitude).asin(), modulus) / lambda);
    // I₂ ω₂' = (I_z − I_x) ω_z ω_x: it falls from the start if I_z < I_x, so the zero is as far as from sn = 0.
    let first = if (i1 - i3) * TUMBLE.x * TUMBLE.z < 0.0 { since_zero } else { half_period - since_zero };
    let mut zeros: Vec<f64> = Vec::new();
    let mut before = TUMBLE.y;
    for k in 0..steps(10.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let now = (engine.state().objects[0].rotation.inverse() * velocity(&*engine, 0).1).y;
        if now.signum() != before.signum() {
            zeros.push((k as f64 + before / (before - now)) * setup.dt_s);
        }
        before = now;
    }
    anyhow::ensure!(!zeros.is_empty(), "the box never flips; it should after {first:.3} s");
    let worst = zeros.iter().enumerate().fold(0.0f64, |worst, (n, t)| {
        let exact = first + n as f64 * half_period;
        worst.max((t / exact - 1.0).abs())
    });
    Ok(recorder.finding(Figure::new("flip time error", 100.0 * worst, "%")))
}

/// Relative error of the rate at which ω circles the axis of a torque-free cylinder, in the body's frame:
/// `(I₃ − I₁)/I₁ · ω₃`. Disc of R = 0.1 m, h = 0.02 m, 1 kg, ω₃ = 20 rad/s, 2 rad/s across.
pub fn symmetric_top(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let disc = Shape::Cylinder { radius: 0.1, half_length: 0.01 };
    let (mut engine, command) =
        SceneBuilder::new(weightless(setup.dt_s))?.body(disc, 1.0, 0.5, Pose::IDENTITY)?.start(setup)?;
    set_velocity(&mut *engine, 0, Vec3::ZERO, Vec3::new(2.0, 0.0, 20.0));
    let inertia = engine.model().objects()[0].inertia;
    let exact = (inertia.z_axis.z - inertia.x_axis.x) / inertia.x_axis.x * 20.0;
    let (mut angle, mut last) = (0.0, 0.0f64);
    let count = steps(2.0, setup.dt_s);
    for _ in 0..count {
        recorder.step(&mut *engine, &command)?;
        let w = engine.state().objects[0].rotation.inverse() * velocity(&*engine, 0).1;
        let now = w.y.atan2(w.x);
        let turn = now - last;
        angle += turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
        last = now;
    }
    let rate = angle / (count as f64 * setup.dt_s);
    Ok(recorder.finding(Figure::new("precession rate error", 100.0 * (rate / exact - 1.0).abs(), "%")))
}
