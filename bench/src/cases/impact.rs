//! Rebounds.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, set_velocity, velocity, weightless};
use super::setup::{Setup, ends_of_steps, steps};
use crate::audit::mechanical;
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "bounce_elastic",
        "49 elastic balls bounce from 5 m for 20 s and keep their energy",
        bounce_elastic,
    ),
    Case::new(
        "bounce_zeno",
        "ball with e = 0.8 falls from 1 m, bounces ever lower and comes to rest",
        bounce_zeno,
    ),
    Case::new(
        "newton_cradle",
        "five equal elastic spheres a tenth of a millimetre apart: the last takes the speed",
        newton_cradle,
    ),
    Case::new(
        "newton_cradle_touching",
        "five equal elastic spheres that touch: by impacts of two the last takes the speed",
        newton_cradle_touching,
    ),
    Case::ours(
        "sliding_impact",
        "a ball that slips meets a wall: rebound and tangential loss by Coulomb's law",
        sliding_impact,
    ),
    Case::ours("dead_impact", "balls with e = 0 fall: what of their speed returns", dead_impact),
];

fn ball(radius: f64, mass: f64, restitution: f64) -> Result<Object> {
    rubbing(radius, mass, restitution, 0.0)
}

fn rubbing(radius: f64, mass: f64, restitution: f64, friction: f64) -> Result<Object> {
    let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius })];
    Ok(Object::new("ball", parts, mass, friction, 0.0)?.with_restitution(restitution))
}

/// Mean over steps of (E − E₀)², J², of 49 balls (10 kg, R = 0.1 m, e = 1, μ = 0) that fall from 5 m, in 20 s; they have
/// 24,034.5 J. Published at 1 ms (SimBenchmark): ODE 185, DART 7.2e4; MuJoCo cannot. The largest rise above E₀ goes
/// to `energy_gain_j`.
pub fn bounce_elastic(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut scene = SceneBuilder::new(awake(setup.dt_s))?.floor(0.0)?;
    for k in 0..49 {
        let at = Pose::translation(f64::from(k % 7) - 3.0, f64::from(k / 7) - 3.0, 5.0);
        scene = scene.object(ball(0.1, 10.0, 1.0)?, at)?;
    }
    let (mut engine, command) = scene.start(setup)?;
    let start = mechanical(&*engine);
    let (mut sum, mut gain): (f64, f64) = (0.0, 0.0);
    let count = steps(20.0, setup.dt_s);
    for _ in 0..count {
        recorder.step(&mut *engine, &command)?;
        let change = mechanical(&*engine) - start;
        sum += change * change;
        gain = gain.max(change);
    }
    let error = Figure::new("mean squared change of energy", sum / count as f64, "J^2");
    Ok(recorder.finding(error).with_energy_gain(gain))
}

/// Largest relative error, in percent, of the first six apexes `h_n = e^(2 n) h₀` and of the time after which
/// a ball with e = 0.8 rests, `√(2 h₀/g) (1 + e)/(1 − e)` = 4.06 s, from h₀ = 1 m. At rest: never again
/// faster than 1 mm/s.
pub fn bounce_zeno(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, e, h0) = (0.05, 0.8, 1.0);
    let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
        .floor(0.0)?
        .object(ball(radius, 0.5, e)?, Pose::translation(0.0, 0.0, radius + h0))?
        .start(setup)?;
    let (mut apexes, mut stopped, mut top): (Vec<f64>, f64, f64) = (Vec::new(), 0.0, 0.0);
    let mut rising = false;
    for t in ends_of_steps(6.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let (z, rate) = (engine.state().objects[0].translation.z - radius, velocity(&*engine, 0).0.z);
        // The apex is between two steps: it follows from the remaining speed.
        top = if rate >= 0.0 { z + rate * rate / (2.0 * G) } else { top };
        if rising && rate < 0.0 {
            apexes.push(top);
        }
        rising = rate > 0.0;
        if rate.abs() > 1e-3 {
            stopped = t;
        }
    }
    let exact = (2.0 * h0 / G).sqrt() * (1.0 + e) / (1.0 - e);
    let mut worst = (stopped / exact - 1.0).abs();
    for (n, apex) in apexes.iter().take(6).enumerate() {
        worst = worst.max((apex / (h0 * e.powi(2 * (n as i32 + 1))) - 1.0).abs());
    }
    anyhow::ensure!(apexes.len() >= 6, "the ball bounced only {} times", apexes.len());
    Ok(recorder.finding(Figure::new("error of an apex or of the time of rest", 100.0 * worst, "%")))
}

fn cradle(setup: &Setup, recorder: &mut Recorder, gap: f64) -> Result<Finding> {
    let radius = 0.02;
    let mut scene = SceneBuilder::new(weightless(setup.dt_s))?;
    for k in 0..5 {
        scene = scene.object(
            ball(radius, 0.1, 1.0)?,
            Pose::translation((2.0 * radius + gap) * f64::from(k), 0.0, 0.0),
        )?;
    }
    let (mut engine, command) = scene.start(setup)?;
    set_velocity(&mut *engine, 0, Vec3::X, Vec3::ZERO);
    let start = mechanical(&*engine);
    recorder.steps(&mut *engine, &command, steps(0.2, setup.dt_s))?;
    let worst = (0..5).fold(0.0f64, |worst, k| {
        let exact = if k == 4 { Vec3::X } else { Vec3::ZERO };
        worst.max((velocity(&*engine, k).0 - exact).length())
    });
    let gain = mechanical(&*engine) - start;
    let error = Figure::new("largest error of a speed", 100.0 * worst, "% of v0");
    Ok(recorder.finding(error).with_energy_gain(gain))
}

/// Largest error of a ball's speed, in percent of v₀ = 1 m/s, after the first of five (0.1 kg, 2 cm, e = 1)
/// with gaps of a tenth of a millimetre has hit the second. Exact: a chain of impacts of two, of which the
/// last ball takes all. `energy_gain_j` is the change of the 0.05 J.
pub fn newton_cradle(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    cradle(setup, recorder, 1e-4)
}

/// The same balls without gaps. Rigid bodies that touch leave the result open; the reference is impacts of
/// two, one after another, as in a cradle.
pub fn newton_cradle_touching(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    cradle(setup, recorder, 0.0)
}

/// Largest error, in percent of the speed of approach, of the normal velocity `e v_n` and of the tangential loss
/// `μ (1 + e) v_n` of balls (170 g, 3 cm) that meet a wall at 1 m/s and slip throughout, for e from 0.1 to 1 and
/// μ of 0.1 to 0.6.
pub fn sliding_impact(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for e in [0.1, 0.3, 0.5, 0.8, 1.0] {
        for mu in [0.1, 0.3, 0.6] {
            let slip = 5.0 * mu * (1.0 + e) + 1.0;
            let (mut engine, command) = SceneBuilder::new(weightless(setup.dt_s))?
                .fixed(
                    &Shape::Box { half_extents: [0.1, 50.0, 50.0], rounding: 0.0 },
                    Pose::translation(-0.1, 0.0, 0.0),
                    mu,
                )?
                .object(rubbing(0.03, 0.17, e, mu)?, Pose::translation(0.0837, 0.0, 0.0))?
                .start(setup)?;
            set_velocity(&mut *engine, 0, Vec3::new(-1.0, slip, 0.0), Vec3::ZERO);
            recorder.steps(&mut *engine, &command, steps(0.12, setup.dt_s))?;
            let after = velocity(&*engine, 0).0;
            worst = worst.max((after.x - e).abs()).max((slip - after.y - mu * (1.0 + e)).abs());
        }
    }
    Ok(recorder.finding(Figure::new("largest error of a velocity", 100.0 * worst, "% of v_n")))
}

/// Largest speed, in percent of that of the fall, with which balls with e = 0 (10 g to 1 kg) ever rise after it.
pub fn dead_impact(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for (radius, mass, height) in [(0.01, 0.02, 0.5), (0.02, 0.0027, 0.3), (0.05, 1.0, 1.0)] {
        let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
            .floor(0.5)?
            .object(rubbing(radius, mass, 0.0, 0.5)?, Pose::translation(0.0, 0.0, radius + height))?
            .start(setup)?;
        for _ in 0..steps(0.8, setup.dt_s) {
            recorder.step(&mut *engine, &command)?;
            worst = worst.max(velocity(&*engine, 0).0.z / (2.0 * G * height).sqrt());
        }
    }
    Ok(recorder.finding(Figure::new("largest speed that returns", 100.0 * worst, "% of v")))
}
