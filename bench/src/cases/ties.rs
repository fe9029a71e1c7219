//! Impacts at one time: the mirror of a symmetric scene is the scene, and so is that of its course.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, kinetic, set_velocity, velocity, weightless};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Command;
use std::f64::consts::TAU;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("break_mirror", "a rack of 15 balls is broken in the middle: mirror balls", break_mirror),
    Case::new(
        "racks_mirror",
        "racks in the plane and in space, turned, e from 0.5 to 1: mirror balls",
        racks_mirror,
    ),
    Case::new("break_energy", "a rack of 15 elastic balls is broken: energy and momentum", break_energy),
    Case::new("tied_blows", "a ball falls between 2, 3 or 4 others: velocities in closed form", tied_blows),
];

/// Radius, m, and mass, kg, of a billiard ball; speed of the break, m/s.
const POOL_M: f64 = 0.028_575;
const POOL_KG: f64 = 0.17;
const BREAK_M_S: f64 = 7.0;

/// Duration of a break, s.
const BREAK_S: f64 = 0.5;

/// Gaps of a rack, m.
const GAPS_M: [f64; 2] = [0.0, 1e-4];

/// A turn about no axis of the world.
fn askew() -> Rotation {
    Rotation::from_scaled_axis(Vec3::new(0.7, -0.4, 1.1))
}

/// Balls at rest, behind a first one that moves along x.
struct Rack {
    at: Vec<Vec3>,
    /// Unit normals of the planes of symmetry, which contain the x axis.
    mirrors: Vec<Vec3>,
}

impl Rack {
    /// A triangle of `rows` rows in the plane z = 0, with its tip in front; `pitch` is the distance of neighbours, m.
    fn triangle(rows: u32, pitch: f64) -> Self {
        let mut at = vec![Vec3::X * -0.1];
        for row in (0..rows).map(f64::from) {
            at.extend((0..=row as u32).map(|place| {
                // Half steps from the middle: a mirror ball has exactly the opposite one.
                let aside = (2.0 * f64::from(place) - row) * 0.5 * pitch;
                Vec3::new(row * pitch * 0.75f64.sqrt(), aside, 0.0)
            }));
        }
        Rack { at, mirrors: vec![Vec3::Y, Vec3::Z] }
    }

    /// A tetrahedron of `layers` triangles, with its tip in front.
    fn tetrahedron(layers: u32, pitch: f64) -> Self {
        let mut at = vec![Vec3::X * -0.1];
        for layer in 0..layers {
            let along = f64::from(layer) * pitch * (2.0 / 3.0f64).sqrt();
            let middle = f64::from(layer) * pitch / 3.0f64.sqrt();
            for ball in &Rack::triangle(layer + 1, pitch).at[1..] {
                at.push(Vec3::new(along, ball.y, ball.x - middle));
            }
        }
        let mirror = |k: u32| Rotation::from_rotation_x(TAU * f64::from(k) / 3.0) * Vec3::Y;
        Rack { at, mirrors: (0..3).map(mirror).collect() }
    }

    /// The mirror ball of a ball.
    fn mirrored(&self, ball: usize, mirror: Vec3) -> usize {
        let image = reflected(self.at[ball], mirror);
        let far = |k: &usize| self.at[*k].distance(image);
        (0..self.at.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(ball)
    }

    /// The rack under an engine, turned by `turn`, about to be hit by its first ball.
    fn start(&self, setup: &Setup, e: f64, turn: Rotation) -> Result<(Box<dyn Engine>, Command)> {
        let mut scene = SceneBuilder::new(weightless(setup.dt_s))?;
        for &at in &self.at {
            scene = scene
                .object(pool_ball(POOL_M, POOL_KG, e)?, Pose::from_parts(turn * at, Rotation::IDENTITY))?;
        }
        let (mut engine, command) = scene.start(setup)?;
        set_velocity(&mut *engine, 0, turn * Vec3::X * BREAK_M_S, Vec3::ZERO);
        Ok((engine, command))
    }

    /// Largest difference between the velocity of a ball and the mirrored one of its mirror ball at the end of a break, as a part
    /// of its speed.
    fn asymmetry(&self, setup: &Setup, recorder: &mut Recorder, e: f64, turn: Rotation) -> Result<f64> {
        let (mut engine, command) = self.start(setup, e, turn)?;
        recorder.steps(&mut *engine, &command, steps(BREAK_S, setup.dt_s))?;
        let mut worst: f64 = 0.0;
        for &mirror in &self.mirrors {
            for ball in 0..self.at.len() {
                let [own, other] = [ball, self.mirrored(ball, mirror)].map(|k| velocity(&*engine, k).0);
                worst = worst.max(own.distance(reflected(other, turn * mirror)) / BREAK_M_S);
            }
        }
        Ok(worst)
    }
}

fn reflected(of: Vec3, mirror: Vec3) -> Vec3 {
    of - mirror * (2.0 * of.dot(mirror))
}

fn pool_ball(radius: f64, mass: f64, e: f64) -> Result<Object> {
    let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius })];
    Ok(Object::new("ball", parts, mass, 0.0, 0.0)?.with_restitution(e))
}

/// Largest difference, as a part of the speed of the break, between the velocity of a ball and the mirrored one of its mirror ball
/// half a second after a ball at 7 m/s has hit the first of 15 in a rack, whose gaps are 0 or 0.1 mm; e = 1, no friction. The
/// mirror of the scene is the scene, and so is that of its course.
pub fn break_mirror(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for gap in GAPS_M {
        let rack = Rack::triangle(5, 2.0 * POOL_M + gap);
        worst = worst.max(rack.asymmetry(setup, recorder, 1.0, Rotation::IDENTITY)?);
    }
    Ok(recorder.finding(Figure::new("largest difference of mirror balls", worst, "of the speed")))
}

/// The same for triangles of 3, 6, 10 and 15 balls and tetrahedra of 4, 10 and 20, with e = 1, 0.8 and 0.5, along the axes of the
/// world and askew.
pub fn racks_mirror(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for pitch in GAPS_M.map(|gap| 2.0 * POOL_M + gap) {
        let triangles = (2..=5).map(|rows| Rack::triangle(rows, pitch));
        let racks = triangles.chain((2..=4).map(|layers| Rack::tetrahedron(layers, pitch)));
        for rack in racks {
            for e in [1.0, 0.8, 0.5] {
                for turn in [Rotation::IDENTITY, askew()] {
                    let found = rack.asymmetry(setup, recorder, e, turn)?;
                    worst = worst.max(found);
                }
            }
        }
    }
    Ok(recorder.finding(Figure::new("largest difference of mirror balls", worst, "of the speed")))
}

/// Largest change of the kinetic energy, as a part of it, and of the momentum in the breaks of `break_mirror`. Without friction and
/// with e = 1 nothing takes or gives either. The change of energy goes to `energy_gain_j`.
pub fn break_energy(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut worst, mut gain): (f64, f64) = (0.0, 0.0);
    for gap in GAPS_M {
        let rack = Rack::triangle(5, 2.0 * POOL_M + gap);
        let (mut engine, command) = rack.start(setup, 1.0, Rotation::IDENTITY)?;
        let count = rack.at.len();
        let energy = |engine: &dyn Engine| (0..count).map(|k| kinetic(engine, k)).sum::<f64>();
        let before = energy(&*engine);
        for _ in 0..steps(BREAK_S, setup.dt_s) {
            recorder.step(&mut *engine, &command)?;
            let momentum = (0..count).fold(Vec3::ZERO, |sum, k| sum + velocity(&*engine, k).0);
            let change = energy(&*engine) - before;
            gain = if change.abs() > gain.abs() { change } else { gain };
            worst = worst.max(change.abs() / before).max(momentum.distance(Vec3::X * BREAK_M_S) / BREAK_M_S);
        }
    }
    let figure = Figure::new("largest change of energy or momentum", worst, "of it");
    Ok(recorder.finding(figure).with_energy_gain(gain))
}

/// Largest error, as a part of the speed, of the velocities after a ball at 1 m/s has met n = 2, 3 or 4 others at once that it touches,
/// each in a direction at 50° from its own. Of masses M and m, with `c = cos 50°`: each of the others leaves along its direction with
/// `P/m`, the ball with `v − n P c/M`, `P = (1 + e) v c/(1/m + n c²/M)`. For e of 1 and 0.5, and m of M/8, M and furniture; along the
/// axes and askew.
pub fn tied_blows(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for n in [2u32, 3, 4] {
        for e in [1.0, 0.5] {
            for part in [Some(0.125), Some(1.0), None] {
                for turn in [Rotation::IDENTITY, askew()] {
                    let found = tied_blow(setup, recorder, n, e, part, turn)?;
                    worst = worst.max(found);
                }
            }
        }
    }
    Ok(recorder.finding(Figure::new("largest error of a velocity", worst, "of the speed")))
}

fn tied_blow(
    setup: &Setup,
    recorder: &mut Recorder,
    n: u32,
    e: f64,
    part: Option<f64>,
    turn: Rotation,
) -> Result<f64> {
    let (speed, angle) = (1.0, 50f64.to_radians());
    let c = libm::cos(angle);
    let around = |k: u32| Rotation::from_rotation_x(TAU * f64::from(k) / f64::from(n));
    let directions: Vec<Vec3> =
        (0..n).map(|k| turn * (around(k) * Vec3::new(c, libm::sin(angle), 0.0))).collect();
    let mut scene =
        SceneBuilder::new(weightless(setup.dt_s))?.object(pool_ball(POOL_M, POOL_KG, e)?, Pose::IDENTITY)?;
    for direction in &directions {
        let place = Pose::from_parts(*direction * (2.0 * POOL_M), Rotation::IDENTITY);
        scene = match part {
            Some(part) => scene.object(pool_ball(POOL_M, POOL_KG * part, e)?, place)?,
            None => scene.fixed(&Shape::Sphere { radius: POOL_M }, place, 0.0)?,
        };
    }
    let (mut engine, command) = scene.start(setup)?;
    set_velocity(&mut *engine, 0, turn * Vec3::X * speed, Vec3::ZERO);
    recorder.steps(&mut *engine, &command, steps(5e-3, setup.dt_s).max(1))?;
    let lightness = part.map_or(0.0, |part| 1.0 / (part * POOL_KG));
    let impulse = (1.0 + e) * speed * c / (lightness + f64::from(n) * c * c / POOL_KG);
    let after = speed - f64::from(n) * impulse * c / POOL_KG;
    let mut worst = velocity(&*engine, 0).0.distance(turn * Vec3::X * after);
    if part.is_some() {
        for (k, direction) in directions.iter().enumerate() {
            worst = worst.max(velocity(&*engine, k + 1).0.distance(*direction * (impulse * lightness)));
        }
    }
    Ok(worst / speed)
}
