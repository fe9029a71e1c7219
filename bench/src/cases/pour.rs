//! Many bodies poured into a box, without a hand.

use super::case::{Case, Finding};
use super::pile::{Escape, add_box};
use super::setup::{Setup, steps};
use crate::random::Random;
use crate::recorder::Recorder;
use anyhow::{Result, bail};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, Config, Model, State};
use std::f64::consts::PI;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "poured_500",
        "500 balls, boxes, cylinders and hulls fall into a box for 2 s",
        |setup, recorder| poured(setup, recorder, 500, 2.0),
    ),
    Case::ours(
        "poured_1000",
        "1,000 balls, boxes, cylinders and hulls fall into a box for 2 s",
        |setup, recorder| poured(setup, recorder, 1000, 2.0),
    ),
];

/// Inner half width of the box, m, and its height: nothing comes over its rim.
const BOX_M: (f64, f64) = (0.3, 5.0);

/// Distances of bodies at the start, along x and y, and along z, m: layers of 8 x 8 in which none touches
/// another.
const SPACING_M: [f64; 2] = [0.07, 0.08];

/// kg/m³
const DENSITY: f64 = 500.0;

/// A body of one of four kinds, in turn, and its volume, m³; none reaches farther than 3.4 cm from its
/// centre.
fn body(kind: usize, random: &mut Random) -> (Shape, f64) {
    let r = random.between(0.015, 0.024);
    match kind % 4 {
        0 => (Shape::Sphere { radius: r }, 4.0 / 3.0 * PI * r.powi(3)),
        1 => (Shape::Box { half_extents: [r, 0.8 * r, 0.6 * r], rounding: 0.0 }, 8.0 * 0.48 * r.powi(3)),
        2 => (Shape::Cylinder { radius: 0.8 * r, half_length: r }, 2.0 * PI * 0.64 * r.powi(3)),
        _ => {
            let point = |random: &mut Random| (random.direction() * r).to_array();
            // The mass of a cube that fits into the sphere of its points.
            (
                Shape::Hull { points: (0..12).map(|_| point(random)).collect(), rounding: 0.0 },
                1.54 * r.powi(3),
            )
        }
    }
}

/// Largest distance of the centre of any of `count` bodies beyond the box within `time_s`. A fault of the
/// world is an error.
pub(crate) fn poured(setup: &Setup, recorder: &mut Recorder, count: usize, time_s: f64) -> Result<Finding> {
    let mut random = Random::new(500);
    let mut model = Model::new(Config::with_step(setup.dt_s), None)?;
    add_box(&mut model, BOX_M)?;
    let mut poses = Vec::new();
    for k in 0..count {
        let (shape, volume) = body(k, &mut random);
        let parts = vec![(Pose::IDENTITY, shape)];
        let object = Object::new(format!("body_{k}"), parts, DENSITY * volume, 0.5, 0.0)?;
        model.add_object(Arc::new(object))?;
        let [column, row, layer] = [k % 8, k / 8 % 8, k / 64].map(|place| place as f64);
        let at =
            Vec3::new((column - 3.5) * SPACING_M[0], (row - 3.5) * SPACING_M[0], 0.05 + layer * SPACING_M[1]);
        poses.push(Pose::from_parts(at + random.cube() * 1e-3, random.rotation()));
    }
    let state = State::at_rest(&model, Pose::IDENTITY, &poses);
    let mut engine = setup.start(model, state)?;
    let command = Command::stay(engine.model(), Pose::IDENTITY);
    let mut escape = Escape::new(count, BOX_M);
    for step in 0..steps(time_s, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        escape.look(&engine.state().objects);
        if let Some(fault) = engine.world().and_then(|world| world.fault()) {
            bail!("fault in step {step}: {fault}");
        }
    }
    Ok(recorder.finding(escape.figure()))
}
