//! Bodies that are placed inside furniture leave it slowly.

use super::case::{Case, Finding};
use super::scene::{awake, cuboid};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::placing::ObjectMotion;
use palmares_sim::{Command, Model, State, World};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[Case::ours(
    "placed_inside",
    "a ball and a box are placed inside tables and the ground: speed with which they leave",
    placed_inside,
)];

/// Half the width of the bodies, m.
const HALF_M: f64 = 0.03;

/// Largest speed, m/s, of a ball (30 mm) and a cube (60 mm) of 0.1 kg as long as they overlap a table 1 to 4 cm thick, or the ground,
/// into which they are placed by 2 to 30 mm, from the air or from where they have come to rest on it. Contacts part what is placed so
/// at 0.2 m/s. Only our own worlds have this way of placing, so that the steps are not timed.
pub fn placed_inside(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut worst, mut where_worst): (f64, String) = (0.0, String::new());
    let shapes = [("ball", Shape::Sphere { radius: HALF_M }), ("cube", cuboid(0.06, 0.06, 0.06))];
    for (name, shape) in shapes {
        for thick in [Some(0.01), Some(0.02), Some(0.04), None] {
            for rested in [false, true] {
                for depth in [2e-3, 5e-3, 1e-2, 3e-2] {
                    let speed = leaves_at(setup.dt_s, &shape, thick, rested, depth)?;
                    if speed > worst {
                        worst = speed;
                        let what = thick.map_or("the ground".into(), |it| format!("{:.0} mm", it * 1e3));
                        let from = if rested { "rest" } else { "the air" };
                        where_worst = format!("{name} {:.0} mm in {what} from {from}", depth * 1e3);
                    }
                }
            }
        }
    }
    Ok(recorder.finding(Figure::new(&format!("fastest, {where_worst}"), worst, "m/s")))
}

/// The largest speed of the body while it overlaps a table `thick`, or the ground.
fn leaves_at(dt_s: f64, shape: &Shape, thick: Option<f64>, rested: bool, depth: f64) -> Result<f64> {
    let mut model = Model::new(awake(dt_s), None)?;
    match thick {
        Some(thick) => {
            let place = Pose::translation(0.0, 0.0, -0.5 * thick);
            model.add_static("table", &cuboid(0.6, 0.6, thick), place, 0.5)?;
        }
        None => model.add_ground(0.0, 0.5),
    }
    let object = Object::new("body", vec![(Pose::IDENTITY, shape.clone())], 0.1, 0.5, 0.0)?;
    model.add_object(Arc::new(object))?;
    let high = if rested { HALF_M } else { 0.5 };
    let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, high)]);
    let mut world = World::new(Arc::new(model), state);
    let command = Command::stay(world.model(), Pose::IDENTITY);
    for _ in 0..steps(0.2, dt_s) {
        world.step(&command);
    }
    let central = Pose::translation(0.0, 0.0, HALF_M - depth);
    world.place_object(0, &ObjectMotion { central, linear: Vec3::ZERO, angular: Vec3::ZERO })?;
    let mut fastest: f64 = 0.0;
    for _ in 0..steps(0.5, dt_s) {
        // The overlap at the start of the step.
        if world.step(&command).penetration_m < 1e-4 {
            break;
        }
        anyhow::ensure!(world.outcome().converged, "a step has not converged");
        fastest = fastest.max(world.state().object_velocity(world.model(), 0).0.length());
    }
    Ok(fastest)
}
