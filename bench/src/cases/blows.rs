//! Blows: whatever is thrown, no blow adds energy, and a blow that glances rebounds as a straight one.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, set_velocity, velocity, weightless};
use super::setup::{Setup, steps};
use crate::audit::mechanical;
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::random::Random;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Config;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours("blows_box", "a box with e = 0.9 is thrown at the ground: energy gained", blows_box),
    Case::ours("blows_gain", "bodies of any shape, e and friction are thrown: energy gained", blows_gain),
    Case::ours("glancing", "a ball meets a wall while it slides along it: rebound e v_n", glancing),
    Case::ours("glancing_weight", "the same on the floor, under its weight", glancing_weight),
];

/// Number of throws of a case.
const THROWS: u32 = 200;

/// Duration of a throw, s: several blows.
const THROW_S: f64 = 0.08;

/// A step in which the velocity of the centre of mass changes by its weight to this, m/s, has no blow.
const FLIGHT_M_S: f64 = 1e-10;

/// What throws have gained.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gains {
    /// Throws that gained more than a billionth of their energy.
    pub gaining: u32,
    /// The largest gain as a part of the energy at the start.
    pub worst: f64,
    /// The throw with it.
    pub worst_throw: u32,
}

/// Throws a box of 60 x 50 x 150 mm and 0.3 kg with e = 0.9 and μ = 0.5.
pub fn blows_box(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let gains = throws(setup, recorder, 0..THROWS, |_| {
        Ok(body("box", vec![(Pose::IDENTITY, cuboid(0.06, 0.05, 0.15))], 0.5)?.with_restitution(0.9))
    })?;
    Ok(found(recorder, gains))
}

/// Throws bodies of every kind with e from 0.3 to 1 and μ from 0.1 to 1.
pub fn blows_gain(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let gains = throws(setup, recorder, 0..THROWS, any_body)?;
    Ok(found(recorder, gains))
}

fn found(recorder: &Recorder, gains: Gains) -> Finding {
    let Gains { gaining, worst, worst_throw } = gains;
    let name = format!("largest gain, {gaining} of {THROWS} throws, most in throw {worst_throw}");
    recorder.finding(Figure::new(&name, worst, "of the energy"))
}

fn body(name: &str, parts: Vec<(Pose, Shape)>, friction: f64) -> Result<Object> {
    Ok(Object::new(name, parts, 0.3, friction, 0.0)?)
}

/// A box, cylinder, capsule, hull, or body of two or three parts, of random size and surface.
pub fn any_body(random: &mut Random) -> Result<Object> {
    let mut size = || random.between(0.015, 0.075);
    let (a, b, c) = (size(), size(), size());
    let block = |x: f64, y: f64, z: f64| cuboid(2.0 * x, 2.0 * y, 2.0 * z);
    let parts = match random.below(6) {
        0 => vec![(Pose::IDENTITY, block(a, b, c))],
        1 => vec![(Pose::IDENTITY, Shape::Cylinder { radius: a, half_length: b })],
        2 => vec![(Pose::IDENTITY, Shape::Capsule { radius: a, half_length: b })],
        3 => {
            let points = (0..12).map(|_| (random.direction() * Vec3::new(a, b, c)).to_array()).collect();
            vec![(Pose::IDENTITY, Shape::Hull { points, rounding: 0.0 })]
        }
        // A hammer: a handle with a head across it.
        4 => vec![
            (Pose::IDENTITY, Shape::Capsule { radius: 0.3 * a, half_length: 0.075 }),
            (Pose::translation(0.0, 0.0, 0.075), block(b, 0.5 * a, 0.4 * c)),
        ],
        // A corner of three bars.
        _ => vec![
            (Pose::translation(b, 0.0, 0.0), block(b, 0.2 * a, 0.2 * a)),
            (Pose::translation(0.0, c, 0.0), block(0.2 * a, c, 0.2 * a)),
            (Pose::translation(0.0, 0.0, a), block(0.2 * a, 0.2 * a, a)),
        ],
    };
    let (e, friction) = (random.between(0.3, 1.0), random.between(0.1, 1.0));
    Ok(body("body", parts, friction)?.with_restitution(e))
}

/// Throws what `body` makes of the random numbers of a throw at the ground: in any pose, at 2 m/s down, up to 1.5 m/s aside
/// along x and y, up to 10 rad/s about each axis. A gain is the rise of kinetic and potential energy in a step with a blow
/// above the least that it had in any step before, with what the contact springs held then.
///
/// # Errors
/// An object cannot be made, or the engine fails.
pub fn throws(
    setup: &Setup,
    recorder: &mut Recorder,
    which: std::ops::Range<u32>,
    body: impl Fn(&mut Random) -> Result<Object>,
) -> Result<Gains> {
    let mut gains = Gains::default();
    for throw in which {
        let gain = gain_of(setup, recorder, throw, &body)?;
        gains.gaining += u32::from(gain > 1e-9);
        if gain > gains.worst {
            (gains.worst, gains.worst_throw) = (gain, throw);
        }
    }
    Ok(gains)
}

fn gain_of(
    setup: &Setup,
    recorder: &mut Recorder,
    throw: u32,
    body: impl Fn(&mut Random) -> Result<Object>,
) -> Result<f64> {
    let mut random = Random::new(u64::from(throw) + 1);
    let object = body(&mut random)?;
    let friction = object.friction;
    // Its lowest point is a little above the ground.
    let turn = random.rotation();
    let above = random.between(1e-3, 2e-2);
    let place = Pose::from_parts(Vec3::new(0.0, 0.0, 1.0), turn);
    let (mut engine, command) =
        SceneBuilder::new(awake(setup.dt_s))?.ground(friction).object(object, place)?.start(setup)?;
    let fall = lowest(&*engine) - above;
    engine.state_mut().objects[0].translation.z -= fall;
    let mut aside = || random.between(-1.5, 1.5);
    let linear = Vec3::new(aside(), aside(), -2.0);
    set_velocity(&mut *engine, 0, linear, random.cube() * 10.0);
    let start = mechanical(&*engine);
    let (mut least, mut gain) = (start, 0.0f64);
    for _ in 0..steps(THROW_S, setup.dt_s) {
        let (before, flight) = (mechanical(&*engine), velocity(&*engine, 0).0 - Vec3::Z * (G * setup.dt_s));
        recorder.step(&mut *engine, &command)?;
        let energy = mechanical(&*engine);
        if velocity(&*engine, 0).0.distance(flight) < FLIGHT_M_S {
            // Nothing acted: a change is the error of the integration of a turning body, which is another matter.
            least += energy - before;
            continue;
        }
        gain = gain.max(energy - least);
        least = least.min(energy + held(&*engine, friction));
    }
    Ok(gain / start)
}

/// Height of the lowest point of the first object, m.
fn lowest(engine: &dyn Engine) -> f64 {
    let at = engine.state().objects[0];
    let of_object =
        |collider: &&palmares_sim::model::Collider| matches!(collider.owner, palmares_sim::Owner::Object(0));
    let bottoms = engine.model().colliders().iter().filter(of_object).map(|collider| {
        let pose = at * collider.body_from_shape;
        collider.shape.compute_aabb(&pose).mins.z
    });
    bottoms.fold(f64::INFINITY, f64::min)
}

/// The most that the contact springs of a body on the ground hold, J: four points at the depth of its lowest one, and the
/// anchors of their friction.
fn held(engine: &dyn Engine, friction: f64) -> f64 {
    let (config, depth) = (engine.model().config(), (-lowest(engine)).max(0.0));
    let force = config.contact_stiffness * depth;
    4.0 * (0.5 * force * depth + 0.5 * (friction * force).powi(2) / config.anchor_stiffness)
}

/// Radius, m, and coefficient of restitution of the ball that glances; slips, m/s; number of gaps, from 2 to 5 mm.
const BALL_M: f64 = 0.02;
const BALL_E: f64 = 0.9;
const SLIPS: [f64; 5] = [0.1, 0.5, 1.0, 2.0, 4.0];
const GAPS: u32 = 40;

/// Largest relative error, in percent, of the rebound `e v_n` of a ball (2 cm, 50 g, e = 0.9, μ = 0.5) that drifts into a wall
/// at 0.1 to 0.4 m/s while it slides along it, from 40 gaps.
pub fn glancing(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    glance(setup, recorder, weightless(setup.dt_s), 0.0)
}

/// The same on the floor, where it meets at `√(v² + 2 g gap)`.
pub fn glancing_weight(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    glance(setup, recorder, awake(setup.dt_s), G)
}

fn glance(setup: &Setup, recorder: &mut Recorder, config: Config, gravity: f64) -> Result<Finding> {
    let (mut worst, mut wrong, mut count): (f64, u32, u32) = (0.0, 0, 0);
    for slip in SLIPS {
        for down in [0.1, 0.2, 0.4] {
            for k in 0..GAPS {
                let gap = 2e-3 + 3e-3 * f64::from(k) / f64::from(GAPS - 1);
                let ball = vec![(Pose::IDENTITY, Shape::Sphere { radius: BALL_M })];
                let ball = Object::new("ball", ball, 0.05, 0.5, 0.0)?.with_restitution(BALL_E);
                let place = Pose::from_parts(Vec3::new(0.0, 0.0, BALL_M + gap), Rotation::IDENTITY);
                let (mut engine, command) =
                    SceneBuilder::new(config.clone())?.floor(0.5)?.object(ball, place)?.start(setup)?;
                set_velocity(&mut *engine, 0, Vec3::new(slip, 0.0, -down), Vec3::ZERO);
                let met = (down * down + 2.0 * gravity * gap).sqrt();
                let mut up: f64 = 0.0;
                for _ in 0..steps(gap / down + 0.05, setup.dt_s).max(4) {
                    recorder.step(&mut *engine, &command)?;
                    let rate = velocity(&*engine, 0).0.z;
                    if rate > 0.0 {
                        let risen = (engine.state().objects[0].translation.z - BALL_M).max(0.0);
                        up = (rate * rate + 2.0 * gravity * risen).sqrt();
                    } else if up > 0.0 {
                        break;
                    }
                }
                let error = (up / (BALL_E * met) - 1.0).abs();
                count += 1;
                wrong += u32::from(error > 0.01);
                worst = worst.max(error);
            }
        }
    }
    let name = format!("largest error of a rebound, {wrong} of {count} wrong");
    Ok(recorder.finding(Figure::new(&name, 100.0 * worst, "%")))
}
