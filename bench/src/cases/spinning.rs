//! What spins: a ball that slides, a top, and a coin on its rim.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, set_velocity, spin, velocity};
use super::setup::{Setup, steps};
use crate::audit::mechanical;
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::shape::inertia::Inertia;
use palmares_models::{Mat3, Pose, Rotation, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("ball_spin", "a ball that slides and spins keeps its spin about the vertical", ball_spin),
    Case::new("top_momentum", "a top on a plane without friction keeps L_z", top_momentum),
    Case::new("coin_rim", "a coin that rolls on its rim keeps its energy", coin_rim),
];

/// Largest change in a second, in percent, of ω_z, and of v_y in percent of the speed, of balls (30 mm, μ = 0.3) that slide at 1
/// m/s along x with −150 rad/s about y and 50 rad/s about z, and the other way round. Exact: 0, friction acts along x and about y.
pub fn ball_spin(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let radius = 0.03;
    let mut worst: f64 = 0.0;
    for (about_y, about_z) in [(-150.0, 50.0), (50.0, 150.0)] {
        let (mut engine, command) = SceneBuilder::new(awake(setup.dt_s))?
            .ground(0.3)
            .body(Shape::Sphere { radius }, 0.1, 0.3, Pose::translation(0.0, 0.0, radius))?
            .start(setup)?;
        set_velocity(&mut *engine, 0, Vec3::X, Vec3::new(0.0, about_y, about_z));
        recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
        let (linear, angular) = velocity(&*engine, 0);
        worst = worst.max((angular.z / about_z - 1.0).abs()).max(linear.y.abs());
    }
    Ok(recorder.finding(Figure::new("largest change", 100.0 * worst, "%")))
}

/// Largest change in 5 s, in percent, of the angular momentum about the vertical through its centre of mass of a top (0.1 kg,
/// centre of mass 40 mm above a tip of 1 mm, 6e-5 and 5e-5 kg m²) that leans by 0.3 rad and spins at 250 rad/s on a plane without
/// friction: nothing turns it about the vertical. The change of energy goes to `energy_gain_j`.
pub fn top_momentum(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (tip, lean, high) = (1e-3, 0.3, 0.04);
    let body = Inertia {
        mass: 0.1,
        com: Vec3::new(0.0, 0.0, high),
        about_com: Mat3::from_diagonal(Vec3::new(6e-5, 6e-5, 5e-5)),
    };
    let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: tip })];
    let top = Object::with_inertia("top", parts, &body, 0.0, 0.0)?;
    let turn = Rotation::from_rotation_x(lean);
    let place = Pose::from_parts(Vec3::new(0.0, 0.0, tip), turn);
    let (mut engine, command) =
        SceneBuilder::new(awake(setup.dt_s))?.ground(0.0).object(top, place)?.start(setup)?;
    set_velocity(&mut *engine, 0, Vec3::ZERO, turn * Vec3::Z * 250.0);
    let (momentum, energy) = (spin(&*engine, 0).z, mechanical(&*engine));
    let mut worst: f64 = 0.0;
    for _ in 0..steps(5.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        worst = worst.max((spin(&*engine, 0).z / momentum - 1.0).abs());
    }
    let gain = mechanical(&*engine) - energy;
    Ok(recorder.finding(Figure::new("change of L_z", 100.0 * worst, "%")).with_energy_gain(gain))
}

/// Radius and half height, m, mass, kg, and lean, rad, of the coin.
const COIN_M: (f64, f64) = (0.04, 0.003);
const COIN_KG: f64 = 0.05;
const COIN_LEAN: f64 = 1.1;

/// Largest change in a second, in percent, of the energy of a coin that leans by 1.1 rad, turns at 25 rad/s about its axis and at 4
/// rad/s about the vertical, and rolls on its rim, for μ from 0.5 to 4. Friction does no work on what rolls, and rolling needs at
/// most 0.438 (equations of motion of the rolling disc by RK4): exact is 0.
pub fn coin_rim(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    let mut gain = f64::NEG_INFINITY;
    for friction in [0.5, 1.0, 4.0] {
        let mut engine = coin(setup, friction)?;
        let command = palmares_sim::Command::stay(engine.model(), Pose::IDENTITY);
        let before = mechanical(&*engine);
        recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
        let change = mechanical(&*engine) - before;
        worst = worst.max((change / before).abs());
        gain = gain.max(change);
    }
    Ok(recorder.finding(Figure::new("change of energy", 100.0 * worst, "%")).with_energy_gain(gain))
}

fn coin(setup: &Setup, friction: f64) -> Result<Box<dyn Engine>> {
    let (radius, half_length) = COIN_M;
    let turn = Rotation::from_rotation_x(COIN_LEAN);
    let axis = turn * Vec3::Z;
    // From the centre to the lowest point of the rim, in the world's axes.
    let down = (axis * axis.z - Vec3::Z).normalize();
    let arm = down * radius - axis * (half_length * axis.z.signum());
    let place = Pose::from_parts(Vec3::new(0.0, 0.0, -arm.z), turn);
    let (mut engine, _) = SceneBuilder::new(awake(setup.dt_s))?
        .ground(friction)
        .body(Shape::Cylinder { radius, half_length }, COIN_KG, friction, place)?
        .start(setup)?;
    let angular = axis * 25.0 + Vec3::Z * 4.0;
    // The lowest point rests.
    set_velocity(&mut *engine, 0, -angular.cross(arm), angular);
    Ok(engine)
}
