//! Surfaces that are only passed: bodies that never meet change nothing in each other's motion.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, cuboid, set_velocity, velocity};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::Result;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("passing_sleeve", "a sleeve falls round a column that it does not touch", passing_sleeve),
    Case::new("passing_edge", "a ball and a box fall past the edge of a table", passing_edge),
];

/// Heights from which a fall begins, one after another.
const STARTS: u32 = 10;

/// Largest change of the speed of fall, as a part, of a sleeve of four walls (12 mm thick, 30 mm high, 0.1 kg, no friction) that
/// falls at 0.5 to 2 m/s round a column 30 x 30 x 100 mm with a play of 0.3 or 1 mm. Exact: 0, it falls freely.
pub fn passing_sleeve(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst = Worst::default();
    for play in [1e-3, 3e-4] {
        let sleeve = sleeve(0.015 + play)?;
        for speed in [0.5, 1.0, 2.0] {
            for k in 0..STARTS {
                // At 2 m/s it is 0.2 m lower, beyond the column's foot, which stands on nothing.
                let place = Pose::translation(0.0, 0.0, 0.13 + 0.00137 * f64::from(k));
                let scene = SceneBuilder::new(awake(setup.dt_s))?
                    .fixed(&cuboid(0.03, 0.03, 0.1), Pose::translation(0.0, 0.0, 0.05), 0.0)?
                    .object(sleeve.clone(), place)?;
                worst.take(fall(setup, recorder, scene, speed)?);
            }
        }
    }
    Ok(worst.found(recorder))
}

/// A square sleeve of this inner half width, m.
fn sleeve(inner: f64) -> Result<Object> {
    let (thick, high) = (0.012, 0.03);
    let (middle, long) = (inner + 0.5 * thick, 2.0 * (inner + thick));
    let across = cuboid(thick, long, high);
    let along = cuboid(2.0 * inner, thick, high);
    let parts = vec![
        (Pose::translation(middle, 0.0, 0.0), across.clone()),
        (Pose::translation(-middle, 0.0, 0.0), across),
        (Pose::translation(0.0, middle, 0.0), along.clone()),
        (Pose::translation(0.0, -middle, 0.0), along),
    ];
    Ok(Object::new("sleeve", parts, 0.1, 0.0, 0.0)?)
}

/// The same of a ball (30 mm) and of a box (40 x 40 x 60 mm) that fall at 0.5 to 2 m/s past the edge of a table with 0.2 to 1 mm
/// between, with friction 0.5.
pub fn passing_edge(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst = Worst::default();
    for (shape, half) in [(Shape::Sphere { radius: 0.03 }, 0.03), (cuboid(0.04, 0.04, 0.06), 0.02)] {
        for play in [2e-4, 5e-4, 1e-3] {
            for speed in [0.5, 1.0, 2.0] {
                for k in 0..STARTS {
                    let place = Pose::translation(0.2 + half + play, 0.0, 0.04 + 0.00137 * f64::from(k));
                    let scene = SceneBuilder::new(awake(setup.dt_s))?
                        .fixed(&cuboid(0.4, 0.4, 0.03), Pose::translation(0.0, 0.0, -0.015), 0.5)?
                        .body(shape.clone(), 0.1, 0.5, place)?;
                    worst.take(fall(setup, recorder, scene, speed)?);
                }
            }
        }
    }
    Ok(worst.found(recorder))
}

/// Change of velocity and spin against free fall after 80 ms, as a part of the speed.
fn fall(setup: &Setup, recorder: &mut Recorder, scene: SceneBuilder, speed: f64) -> Result<f64> {
    let (mut engine, command) = scene.start(setup)?;
    set_velocity(&mut *engine, 0, Vec3::Z * -speed, Vec3::ZERO);
    let count = steps(0.08, setup.dt_s);
    recorder.steps(&mut *engine, &command, count)?;
    let exact = speed + G * count as f64 * setup.dt_s;
    let (linear, angular) = velocity(&*engine, 0);
    Ok((linear + Vec3::Z * exact).length().max(0.03 * angular.length()) / exact)
}

/// The largest change of many falls, and how many are changed.
#[derive(Default)]
struct Worst {
    change: f64,
    changed: u32,
    falls: u32,
}

impl Worst {
    fn take(&mut self, change: f64) {
        self.change = self.change.max(change);
        // What the bound of the case allows.
        self.changed += u32::from(change > 1e-6);
        self.falls += 1;
    }

    fn found(&self, recorder: &Recorder) -> Finding {
        let name = format!("largest change of velocity, {} of {} falls changed", self.changed, self.falls);
        recorder.finding(Figure::new(&name, self.change, "of the speed"))
    }
}
