//! An arch of loose stones that friction alone keeps.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, rigid};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use anyhow::{Result, ensure};
use palmares_models::Pose;
use palmares_models::shape::Shape;
use std::f64::consts::PI;

/// Cases of this file.
pub const CASES: &[Case] = &[Case::new(
    "arch",
    "half circle of 11 loose stones: a thick one stands, a thin one falls; motion of the keystone",
    arch,
)];

/// Number of stones, mean radius and depth, m, density, kg/m³.
const STONES: usize = 11;
const RADIUS_M: f64 = 0.5;
const DEPTH_M: f64 = 0.1;
const DENSITY: f64 = 2000.0;

/// Thickness of the arch that stands and of the one that falls, as parts of the radius: a half circle needs 0.1075
/// (Milankovitch 1907), if no stone slides.
const THICK: f64 = 0.2;
const THIN: f64 = 0.08;

/// Friction coefficient: no joint of an arch that stands needs more than 0.4.
const FRICTION: f64 = 0.8;

/// Largest motion, mm, of the keystone of the thick arch in 2 s. The stones touch exactly at the start. Exact: none, as rigid
/// stones; the contacts are [`RIGID`](crate::engine::RIGID). The keystone of the thin arch must be 5 cm lower in the end: no line of
/// thrust lies within it.
pub fn arch(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let stands = keystone(setup, recorder, THICK)?;
    let falls = keystone(setup, recorder, THIN)?;
    ensure!(falls > 0.05, "the thin arch stands: its keystone moved by {falls} m");
    Ok(recorder.finding(Figure::new("motion of the keystone", stands * 1e3, "mm")))
}

/// Largest motion of the keystone of an arch, m.
fn keystone(setup: &Setup, recorder: &mut Recorder, thickness: f64) -> Result<f64> {
    let radii = [RADIUS_M * (1.0 - 0.5 * thickness), RADIUS_M * (1.0 + 0.5 * thickness)];
    let mut scene = SceneBuilder::new(rigid(setup.dt_s))?.floor(FRICTION)?;
    let part = PI / STONES as f64;
    // A ring between two chords.
    let mass = DENSITY * DEPTH_M * 0.5 * part.sin() * (radii[1] * radii[1] - radii[0] * radii[0]);
    for k in 0..STONES {
        let mut points = Vec::new();
        for end in [k, k + 1] {
            let (sin, cos) = libm::sincos(end as f64 * part);
            for radius in radii {
                points.extend([-0.5, 0.5].map(|side| [radius * cos, side * DEPTH_M, radius * sin.max(0.0)]));
            }
        }
        scene = scene.body(Shape::Hull { points, rounding: 0.0 }, mass, FRICTION, Pose::IDENTITY)?;
    }
    let (mut engine, command) = scene.start(setup)?;
    let middle = STONES / 2;
    let start = engine.state().objects[middle].translation;
    let mut moved: f64 = 0.0;
    for _ in 0..steps(2.0, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        moved = moved.max((engine.state().objects[middle].translation - start).length());
    }
    Ok(moved)
}
