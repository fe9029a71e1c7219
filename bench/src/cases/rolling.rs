//! Rolling, and sliding until it rolls.

use super::case::{Case, Finding};
use super::scene::{
    G, SceneBuilder, awake, cuboid, kick, kinetic, push, rigid, set_velocity, settle, tilted, velocity,
};
use super::setup::{Setup, ends_of_steps, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Config;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "rolling_cylinder",
        "cylinder rolls along a floor for 10 s and keeps its energy",
        rolling_cylinder,
    ),
    Case::new(
        "incline_sphere",
        "sphere on a slope: rolls with 5/7 g sin th, or slides and spins up",
        incline_sphere,
    ),
    Case::new("bowling", "sphere thrown without spin slides, then rolls with 5/7 of its speed", bowling),
    Case::new(
        "rolling_box_balls",
        "10 kg box dragged over the ground with 25 balls rolling on it",
        rolling_box_balls,
    ),
    Case::new("spring_cylinder", "cylinder on a spring rolls to and fro for 5 s", spring_cylinder),
];

const LYING: f64 = std::f64::consts::FRAC_PI_2;

/// Relative loss of speed of a cylinder rolling for 10 s at 0.05 m/s, in percent. The largest mean kinetic
/// energy of any of the ten seconds above that of the start goes to `energy_gain_j`. Means, because the
/// contact springs make the kinetic energy oscillate by a millionth. Exact: no loss, no gain.
pub fn rolling_cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, v0) = (0.04, 0.05);
    let pose = Pose::from_parts(Vec3::new(0.0, 0.0, radius), Rotation::from_rotation_x(LYING));
    let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
        .floor(0.5)?
        .body(Shape::Cylinder { radius, half_length: 0.035 }, 0.1, 0.5, pose)?
        .start(setup)?;
    settle(&mut *engine, &command, 0.5)?;
    // A body that has sunk in rolls on the middle of the overlap.
    let lever = 0.5 * (radius + engine.state().objects[0].translation.z);
    set_velocity(&mut *engine, 0, Vec3::new(v0, 0.0, 0.0), Vec3::new(0.0, v0 / lever, 0.0));
    let start = kinetic(&*engine, 0);
    let mut gain: f64 = 0.0;
    let second = steps(1.0, setup.dt_s);
    for _ in 0..10 {
        let mut sum = 0.0;
        for _ in 0..second {
            recorder.step(&mut *engine, &command)?;
            sum += kinetic(&*engine, 0);
        }
        gain = gain.max(sum / second as f64 - start);
    }
    let loss = 100.0 * (1.0 - velocity(&*engine, 0).0.x / v0);
    let error = Figure::new("speed lost in 10 s", loss.abs(), "%");
    Ok(recorder.finding(error).with_energy_gain(gain))
}

/// Largest relative error of acceleration and angular acceleration, in percent, of a solid sphere (R = 0.05 m, 1 kg)
/// on a slope of tan θ = 0.7. It rolls if μ ≥ 2/7 tan θ, with `a = 5/7 g sin θ` and `α = a/R`; else it slides with
/// `a = g (sin θ − μ cos θ)` and `α = 5 μ g cos θ/(2 R)`.
pub fn incline_sphere(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, tan) = (0.05, 0.7f64);
    let cos = 1.0 / (1.0 + tan * tan).sqrt();
    let mut worst: f64 = 0.0;
    for mu in [0.5, 0.22, 0.18, 0.1] {
        let (a, alpha) = if mu >= 2.0 / 7.0 * tan {
            let a = 5.0 / 7.0 * G * cos * tan;
            (a, a / radius)
        } else {
            (G * cos * (tan - mu), 2.5 * mu * G * cos / radius)
        };
        let (mut engine, command) = SceneBuilder::new(tilted(rigid(setup.dt_s), tan))?
            .floor(mu)?
            .body(Shape::Sphere { radius }, 1.0, mu, Pose::translation(0.0, 0.0, radius))?
            .start(setup)?;
        recorder.steps(&mut *engine, &command, steps(0.2, setup.dt_s))?;
        let before = velocity(&*engine, 0);
        let count = steps(0.5, setup.dt_s);
        recorder.steps(&mut *engine, &command, count)?;
        let (after, t) = (velocity(&*engine, 0), count as f64 * setup.dt_s);
        worst = worst.max(((after.0.x - before.0.x) / t / a - 1.0).abs());
        worst = worst.max(((after.1.y - before.1.y) / t / alpha - 1.0).abs());
    }
    Ok(recorder.finding(Figure::new("acceleration error", 100.0 * worst, "%")))
}

/// Largest relative error, in percent, of the final speed 5 v₀/7 and of the time 2 v₀/(7 μ g) from which a
/// sphere (R = 0.1 m, 1 kg, μ = 0.3) thrown at v₀ = 2 m/s without spin rolls. The time follows from the line
/// through the sliding speeds at a quarter and three quarters of it. Ball and floor are rigid.
pub fn bowling(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, mu, v0) = (0.1, 0.3, 2.0);
    let (speed, time) = (5.0 / 7.0 * v0, 2.0 * v0 / (7.0 * mu * G));
    let (mut engine, command) = SceneBuilder::new(rigid(setup.dt_s))?
        .floor(mu)?
        .body(Shape::Sphere { radius }, 1.0, mu, Pose::translation(0.0, 0.0, radius))?
        .start(setup)?;
    settle(&mut *engine, &command, 0.5)?;
    set_velocity(&mut *engine, 0, Vec3::new(v0, 0.0, 0.0), Vec3::ZERO);
    let (mut early, mut late) = (None, None);
    for t in ends_of_steps(1.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let (linear, angular) = velocity(&*engine, 0);
        let slip = linear.x - angular.y * radius;
        if t >= 0.25 * time {
            early.get_or_insert((t, slip));
        }
        if t >= 0.75 * time {
            late.get_or_insert((t, slip));
        }
    }
    let ((t0, s0), (t1, s1)) = early.zip(late).unwrap_or(((0.0, 1.0), (0.0, 1.0)));
    let rolls_from = t1 + s1 * (t1 - t0) / (s0 - s1);
    let (linear, angular) = velocity(&*engine, 0);
    let worst = [linear.x / speed, angular.y * radius / speed, rolls_from / time];
    let worst = worst.into_iter().map(|x| (x - 1.0).abs()).fold(0.0, f64::max);
    Ok(recorder.finding(Figure::new("error of speed or time", 100.0 * worst, "%")))
}

/// Mean over steps of the squared velocity errors of box and balls, (m/s)², over 4 s; the larger of two headings. The
/// rolling test of SimBenchmark (leggedrobotics/SimBenchmark): M = 10 kg on the ground (μ₁ = 0.4), n = 25 balls of m =
/// 1 kg on it (μ₂ = 0.8), F = 150 N. With `f₁ = μ₁ (M + n m) g` and `f₂ = (F − f₁)/(M (3.5/m + n/M))` on each ball,
/// `a_ball = f₂/m` and `a_box = (F − f₁ − n f₂)/M`. Published at 1 ms along 60°: RaiSim 4.1e-7, Bullet 5.7e-9, MuJoCo
/// 7e-3; engines with a friction pyramid do not move at all (3.1). Its bodies are rigid: the springs of our soft
/// contacts would throw the box off at 2 cm/s when friction gives way.
pub fn rolling_box_balls(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (big, n, m) = (10.0, 25.0, 1.0);
    let (ground, top, push_n) = (0.4, 0.8, 150.0);
    let friction = ground * (big + n * m) * G;
    let each = (push_n - friction) / big / (3.5 / m + n / big);
    let (a_ball, a_box) = (each / m, (push_n - friction - n * each) / big);
    let mut worst: f64 = 0.0;
    for degrees in [90.0f64, 60.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let direction = Vec3::new(cos, sin, 0.0);
        let (length, height, radius) = (20.0, 0.1, 0.1);
        let at = Pose::translation(0.0, 0.0, 0.5 * height);
        // Friction of a pair is the geometric mean: box and balls have their mutual one, the floor one that
        // results in μ₁.
        let floor = ground * ground / top;
        let mut scene = SceneBuilder::new(rigid(setup.dt_s))?.floor(floor)?.body(
            cuboid(length, length, height),
            big,
            top,
            at,
        )?;
        for k in 0..25 {
            let (x, y) = (f64::from(k % 5) - 2.0, f64::from(k / 5) - 2.0);
            let pose = Pose::translation(2.0 * x, 2.0 * y, height + radius);
            scene = scene.body(Shape::Sphere { radius }, m, top, pose)?;
        }
        let (mut engine, command) = scene.start(setup)?;
        settle(&mut *engine, &command, 0.5)?;
        let count = steps(4.0, setup.dt_s);
        let mut sum = 0.0;
        for k in 0..count {
            push(&mut *engine, 0, direction * push_n, Vec3::ZERO);
            recorder.step(&mut *engine, &command)?;
            let t = (k + 1) as f64 * setup.dt_s;
            sum += (velocity(&*engine, 0).0 - direction * (a_box * t)).length_squared();
            sum += (velocity(&*engine, 13).0 - direction * (a_ball * t)).length_squared();
        }
        worst = worst.max(sum / count as f64);
    }
    Ok(recorder.finding(Figure::new("mean squared velocity error", worst, "(m/s)^2")))
}

/// Largest error, in percent of x₀, of a cylinder (R = 0.05 m, 0.5 kg) on a spring of k = 100 N/m at its
/// axis, released at x₀ = 0.1 m, in 5 s; the larger of rolling (μ = 1, `x = x₀ cos(√(k/(1.5 m)) t)`) and
/// sliding (μ = 0, `x = x₀ cos(√(k/m) t)`). The gain of energy goes to `energy_gain_j`. After Castro,
/// Permenter, Han 2022, VI-B, contact k = 10⁴ N/m and 0.02 s. It sinks by δ and rolls on the middle of the
/// overlap, R − δ/2, which after 9 periods is 4 % of x₀; the answer includes it. The spring acts as an
/// impulse by its elongation at the start of the step.
pub fn spring_cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, mass, k, x0) = (0.05, 0.5, 100.0, 0.1);
    let (mut worst, mut gain): (f64, f64) = (0.0, 0.0);
    // Two contact points carry it.
    let sunk = mass * G / 2e4;
    let lever = radius - 0.5 * sunk;
    for (mu, effective) in [(1.0, mass * (1.0 + 0.5 * (radius / lever).powi(2))), (0.0, mass)] {
        let config = Config { contact_stiffness: 1e4, contact_dissipation_s: 0.02, ..awake(setup.dt_s) };
        let at = Pose::from_parts(Vec3::new(x0, 0.0, radius - sunk), Rotation::from_rotation_x(LYING));
        let (mut engine, command) = SceneBuilder::new(config)?
            .floor(mu)?
            .body(Shape::Cylinder { radius, half_length: 0.05 }, mass, mu, at)?
            .start(setup)?;
        let omega = f64::sqrt(k / effective);
        let energy = 0.5 * k * x0 * x0;
        for t in ends_of_steps(5.0, setup.dt_s) {
            let x = engine.state().objects[0].translation.x;
            kick(&mut *engine, 0, Vec3::new(-k * x, 0.0, 0.0));
            recorder.step(&mut *engine, &command)?;
            let x = engine.state().objects[0].translation.x;
            worst = worst.max((x - x0 * (omega * t).cos()).abs() / x0);
            gain = gain.max(0.5 * k * x * x + kinetic(&*engine, 0) - energy);
        }
    }
    let error = Figure::new("position error", 100.0 * worst, "% of x0");
    Ok(recorder.finding(error).with_energy_gain(gain))
}
