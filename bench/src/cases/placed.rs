//! Bodies that a state puts into furniture leave it slowly.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid, set_velocity, velocity};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[Case::ours(
    "placed_inside",
    "a ball and a box are put into tables and the ground: speed with which they leave",
    placed_inside,
)];

/// Largest speed, m/s, of a ball (30 mm) and a cube (60 mm) of 0.1 kg as long as they overlap a table 1 to 4 cm thick, or the ground,
/// into which they are put by 2 to 30 mm from the air. Contacts part what is placed so at 0.2 m/s.
pub fn placed_inside(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let half = 0.03;
    let (mut worst, mut where_worst): (f64, String) = (0.0, String::new());
    for (name, shape) in [("ball", Shape::Sphere { radius: half }), ("cube", cuboid(0.06, 0.06, 0.06))] {
        // The ground has no end below.
        for thick in [0.01, 0.02, 0.04, f64::INFINITY] {
            for depth in [2e-3, 5e-3, 1e-2, 3e-2] {
                let scene = SceneBuilder::new(awake(setup.dt_s))?;
                let scene = if thick.is_finite() {
                    scene.fixed(&cuboid(0.6, 0.6, thick), Pose::translation(0.0, 0.0, -0.5 * thick), 0.5)?
                } else {
                    scene.ground(0.5)
                };
                let (mut engine, command) =
                    scene.body(shape.clone(), 0.1, 0.5, Pose::translation(0.0, 0.0, 0.5))?.start(setup)?;
                recorder.step(&mut *engine, &command)?;
                engine.state_mut().objects[0] = Pose::translation(0.0, 0.0, half - depth);
                set_velocity(&mut *engine, 0, Vec3::ZERO, Vec3::ZERO);
                for _ in 0..steps(0.5, setup.dt_s) {
                    recorder.step(&mut *engine, &command)?;
                    // It overlapped at the start of this step.
                    if engine.outcome().penetration_m < 1e-4 {
                        break;
                    }
                    let speed = velocity(&*engine, 0).0.length();
                    if speed > worst {
                        worst = speed;
                        where_worst = format!("{name} {:.0} mm in {:.0} mm", depth * 1e3, thick * 1e3);
                    }
                }
            }
        }
    }
    Ok(recorder.finding(Figure::new(&format!("fastest, {where_worst}"), worst, "m/s")))
}
