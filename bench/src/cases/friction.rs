//! Sliding and rolling on furniture, with textbook answers.

use super::{Case, Finding, Setup, steps};
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::report::{Figure, Invariants};
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case {
        name: "incline_critical",
        about: "block on a slope of 0.99 mu (creep) and 1.2 mu (acceleration)",
        peers: true,
        run: incline_critical,
    },
    Case {
        name: "slide_stop",
        about: "cube thrown along a floor in three directions stops after v0^2/(2 mu g)",
        peers: true,
        run: slide_stop,
    },
    Case {
        name: "rolling_cylinder",
        about: "cylinder rolls along a floor for 10 s and keeps its energy",
        peers: true,
        run: rolling_cylinder,
    },
];

const G: f64 = 9.81;

/// One object on a wide plate whose top is z = 0.
fn on_plate(
    setup: &Setup,
    config: Config,
    shape: Shape,
    mass: f64,
    friction: f64,
    pose: Pose,
) -> Result<(Box<dyn Engine>, Command)> {
    let mut model = Model::new(config, None)?;
    let plate = Shape::Box { half_extents: [20.0, 20.0, 0.05], rounding: 0.0 };
    model.add_static("plate", &plate, Pose::translation(0.0, 0.0, -0.05), friction)?;
    let object = Object::new("body", vec![(Pose::IDENTITY, shape)], mass, friction, 0.0)?;
    model.add_object(Arc::new(object))?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[pose]);
    let command = Command::stay(&model, Pose::IDENTITY);
    Ok((setup.start(model, state)?, command))
}

fn awake(dt_s: f64) -> Config {
    // A sleeping body would neither creep nor lose speed: these cases are about the contact law.
    Config { sleeping: false, ..Config::with_step(dt_s) }
}

/// Largest relative error of the sliding acceleration at tan θ = 1.2 μ, in percent; creep at 0.99 μ over 10 s
/// goes to `slip_mm_s`. Exact: a = g (sin θ − μ cos θ), and rest.
pub fn incline_critical(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mu = 0.5;
    let cube = Shape::Box { half_extents: [0.03, 0.03, 0.03], rounding: 0.0 };
    let slope = |ratio: f64| {
        let tan = ratio * mu;
        let cos = 1.0 / (1.0 + tan * tan).sqrt();
        let gravity = Vec3::new(G * cos * tan, 0.0, -G * cos);
        (Config { gravity, ..awake(setup.dt_s) }, G * cos * (tan - mu))
    };
    let at = Pose::translation(0.0, 0.0, 0.03);
    let (config, _) = slope(0.99);
    let (mut world, command) = on_plate(setup, config, cube.clone(), 0.5, mu, at)?;
    // The first second loads the anchor; creep is what remains after.
    for _ in 0..steps(1.0, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
    }
    let start = world.state().objects[0].translation;
    for _ in 0..steps(10.0, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
    }
    let creep = (world.state().objects[0].translation - start).length() / 10.0;
    let (config, exact) = slope(1.2);
    let (mut world, command) = on_plate(setup, config, cube, 0.5, mu, at)?;
    for _ in 0..steps(0.5, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
    }
    let before = world.state().v[0];
    for _ in 0..steps(1.0, setup.dt_s) {
        recorder.step(&mut *world, &command)?;
    }
    let acceleration = (world.state().v[0] - before) / (steps(1.0, setup.dt_s) as f64 * setup.dt_s);
    let error = 100.0 * (acceleration / exact - 1.0).abs();
    Ok(Finding {
        error: Figure::new("acceleration error at 1.2 mu", error, "%"),
        invariants: Invariants { slip_mm_s: Some(creep * 1e3), ..recorder.invariants() },
    })
}

/// Largest relative error of the stopping distance v₀²/(2 μ g) over three headings, in percent; the
/// sideways deviation counts as well.
pub fn slide_stop(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mu, v0) = (0.4, 1.0);
    let exact = v0 * v0 / (2.0 * mu * G);
    let mut worst: f64 = 0.0;
    for degrees in [0.0f64, 22.5, 45.0] {
        let heading = degrees.to_radians();
        let direction = Vec3::new(heading.cos(), heading.sin(), 0.0);
        let cube = Shape::Box { half_extents: [0.1, 0.1, 0.1], rounding: 0.0 };
        let at = Pose::translation(0.0, 0.0, 0.1);
        let (mut world, command) = on_plate(setup, awake(setup.dt_s), cube, 1.0, mu, at)?;
        // It starts settled: half a millimetre of sinking while sliding would be an error of the start.
        for _ in 0..steps(0.5, setup.dt_s) {
            world.step(&command)?;
        }
        let start = world.state().objects[0].translation;
        world.state_mut().v[..3].copy_from_slice(&(direction * v0).to_array());
        for _ in 0..steps(0.5, setup.dt_s) {
            recorder.step(&mut *world, &command)?;
        }
        let travelled = world.state().objects[0].translation - start;
        let flat = Vec3::new(travelled.x, travelled.y, 0.0);
        worst = worst.max((flat - direction * exact).length() / exact);
    }
    Ok(Finding {
        error: Figure::new("stopping distance error", 100.0 * worst, "%"),
        invariants: recorder.invariants(),
    })
}

/// Relative loss of speed of a cylinder rolling for 10 s at 0.05 m/s, in percent; what the mean
/// kinetic energy of any of the ten seconds has above that of the start goes to `energy_gain_j`. Means, because
/// the contact springs breathe: kinetic energy wavers by a millionth. Exact: neither loss nor gain.
pub fn rolling_cylinder(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (radius, v0) = (0.04, 0.05);
    let cylinder = Shape::Cylinder { radius, half_length: 0.035 };
    let lying = Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let pose = Pose::from_parts(Vec3::new(0.0, 0.0, radius), lying);
    let (mut world, command) = on_plate(setup, awake(setup.dt_s), cylinder, 0.1, 0.5, pose)?;
    for _ in 0..steps(0.5, setup.dt_s) {
        world.step(&command)?;
    }
    let v = &mut world.state_mut().v;
    v.copy_from_slice(&[v0, 0.0, 0.0, 0.0, v0 / radius, 0.0]);
    let object = Arc::clone(&world.model().objects()[0]);
    let (mass, inertia) = (object.mass, object.inertia);
    let energy = |world: &dyn Engine| {
        let v = &world.state().v;
        let linear = Vec3::new(v[0], v[1], v[2]);
        let angular = world.state().objects[0].rotation.inverse() * Vec3::new(v[3], v[4], v[5]);
        0.5 * mass * linear.length_squared() + 0.5 * angular.dot(inertia * angular)
    };
    let start = energy(&*world);
    let mut means: Vec<f64> = Vec::new();
    let second = steps(1.0, setup.dt_s);
    for _ in 0..10 {
        let mut sum = 0.0;
        for _ in 0..second {
            recorder.step(&mut *world, &command)?;
            sum += energy(&*world);
        }
        means.push(sum / second as f64);
    }
    let gain = means.iter().fold(0.0, |gain: f64, mean| gain.max(mean - start));
    let loss = 100.0 * (1.0 - world.state().v[0] / v0);
    Ok(Finding {
        error: Figure::new("speed lost in 10 s", loss.abs(), "%"),
        invariants: Invariants { energy_gain_j: Some(gain), ..recorder.invariants() },
    })
}
