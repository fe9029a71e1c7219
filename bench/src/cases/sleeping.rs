//! Sleep: what turns back or swings slowly does not rest, and what rests still presses on the ground.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, cuboid, set_velocity, tilted};
use super::setup::{Setup, ends_of_steps, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::{Context, Result};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::shape::inertia::Inertia;
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_sim::Config;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours("slope_return", "a ball rolls up a gentle slope, turns back and rolls down", slope_return),
    Case::ours("roly_poly", "a ball with a low centre of mass swings for a minute", roly_poly),
    Case::ours("asleep_presses", "a box that sleeps reports the forces that carry it", asleep_presses),
];

/// Largest error, in percent, of the way in 20 s of a ball (30 mm) that rolls up slopes of 1e-4, 2e-4 and 5e-4 at 4 mm/s:
/// `v t − ½ (5/7) g sin t²`. A part is one of the way down alone. Worlds sleep here as they do by default.
pub fn slope_return(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, up, time) = (0.03, 4e-3, 20.0);
    let mut worst: f64 = 0.0;
    for slope in [1e-4, 2e-4, 5e-4f64] {
        let (mut engine, command) = SceneBuilder::new(tilted(Config::with_step(setup.dt_s), slope))?
            .ground(0.5)
            .body(Shape::Sphere { radius }, 0.1, 0.5, Pose::translation(0.0, 0.0, radius))?
            .start(setup)?;
        // Down the slope is +x.
        set_velocity(&mut *engine, 0, Vec3::X * -up, Vec3::Y * (-up / radius));
        recorder.steps(&mut *engine, &command, steps(time, setup.dt_s))?;
        let down = 5.0 / 14.0 * G * slope / (1.0 + slope * slope).sqrt() * time * time;
        let error = engine.state().objects[0].translation.x - (down - up * time);
        worst = worst.max((error / down).abs());
    }
    Ok(recorder.finding(Figure::new("largest error of the way", 100.0 * worst, "% of the way down")))
}

/// Largest error in a minute, in percent of its amplitude of 0.05 rad, of the lean of a ball (50 mm, 0.1 kg) whose centre of mass
/// is 0.2 mm below its middle: it rolls to and fro with a period of about 8 s, `α̈ (I + m (R² + d² − 2 R d cos α)) = −m d sin α (g + R
/// α̇²)`, here by RK4.
pub fn roly_poly(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, mass, low, lean) = (0.05, 0.1, 2e-4, 0.05);
    let inertia = 0.4 * mass * radius * radius;
    let body = Inertia {
        mass,
        com: Vec3::new(0.0, 0.0, -low),
        about_com: Mat3::from_diagonal(Vec3::splat(inertia)),
    };
    let ball =
        Object::with_inertia("roly_poly", vec![(Pose::IDENTITY, Shape::Sphere { radius })], &body, 0.5, 0.0)?;
    let place = Pose::from_parts(Vec3::new(0.0, 0.0, radius), Rotation::from_rotation_y(lean));
    let (mut engine, command) =
        SceneBuilder::new(Config::with_step(setup.dt_s))?.ground(0.5).object(ball, place)?.start(setup)?;
    let slope = |[angle, rate]: [f64; 2]| {
        let moment = inertia + mass * (radius * radius + low * low - 2.0 * radius * low * angle.cos());
        [rate, -mass * low * angle.sin() * (G + radius * rate * rate) / moment]
    };
    let (mut exact, mut worst): ([f64; 2], f64) = ([lean, 0.0], 0.0);
    for _ in ends_of_steps(60.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        exact = runge_kutta(exact, setup.dt_s, slope);
        let up = engine.state().objects[0].rotation * Vec3::Z;
        worst = worst.max((libm::atan2(up.x, up.z) - exact[0]).abs() / lean);
    }
    Ok(recorder.finding(Figure::new("largest error of the lean", 100.0 * worst, "% of the amplitude")))
}

/// A step of the classical method of fourth order.
fn runge_kutta(y: [f64; 2], h: f64, slope: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let ahead = |k: [f64; 2], part: f64| [y[0] + part * h * k[0], y[1] + part * h * k[1]];
    let first = slope(y);
    let second = slope(ahead(first, 0.5));
    let third = slope(ahead(second, 0.5));
    let last = slope(ahead(third, 1.0));
    [0, 1].map(|i| y[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + last[i]))
}

/// Error, in percent of the weight, of the sum of contact forces on a box that sleeps.
pub fn asleep_presses(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (edge, mass) = (0.1, 1.0);
    let (mut engine, command) = SceneBuilder::new(Config::with_step(setup.dt_s))?
        .ground(0.5)
        .body(cuboid(edge, edge, edge), mass, 0.5, Pose::translation(0.0, 0.0, 0.5 * edge))?
        .start(setup)?;
    recorder.steps(&mut *engine, &command, steps(2.0, setup.dt_s))?;
    anyhow::ensure!(engine.state().sleep[0].asleep, "the box does not sleep");
    let world = engine.world().context("only our own engine sleeps")?;
    let carried: Vec3 = world.contact_forces().iter().map(|contact| contact.force).sum();
    let error = (carried - Vec3::Z * (mass * G)).length() / (mass * G);
    Ok(recorder.finding(Figure::new("error of the forces", 100.0 * error, "% of the weight")))
}
