//! The balls task's scene with a scripted hand.

use super::case::{Case, Finding};
use super::setup::{Setup, ends_of_steps, ramp, risen};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use crate::rigs::softhand;
use anyhow::{Context, Result};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Command;
use palmares_tasks::Seed;
use palmares_tasks::Task;
use palmares_tasks::build::build;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[Case::new(
    "softhand_balls",
    "SoftHand reaches into a box of ten 1 kg balls, closes and lifts; self-collision on",
    softhand_balls,
)];

/// The task `balls` with the balls of the 2016 framework's template, of 1 kg and with friction 1: ten of them are harder for
/// an engine than real ones, and the figures of the case do not change with the task.
fn heavy_balls() -> Result<Task> {
    let text = Task::builtin_toml("balls").context("balls is built in")?;
    let mut table: toml::Table = text.parse()?;
    let ball =
        table.get_mut("objects").and_then(|objects| objects.get_mut("equal")).context("balls are equal")?;
    for (field, value) in [("mass", 1.0), ("friction", 1.0)] {
        *ball.get_mut(field).with_context(|| format!("a ball has {field}"))? = toml::Value::Float(value);
    }
    Ok(Task::parse("balls", &table.to_string())?)
}

/// Ten balls in box A; the hand comes down among them, closes and rises, over 5 s. The figure is how far the
/// centre of a ball got out of the boxes' outer planes: nothing may pass through a wall.
pub fn softhand_balls(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut task = heavy_balls()?;
    task.step_s = setup.dt_s;
    let built = build(&task, Some(softhand()?), Seed::from_u64(1))?;
    // Fingers down, palm towards -x, in the middle of the box.
    let down = Rotation::from_rotation_y(std::f64::consts::PI);
    let top = Pose::from_parts(Vec3::new(0.05, 0.0, 0.6), down);
    let mut state = built.world.state().clone();
    state.base = top;
    state.reference.pose = state.base;
    let mut world = setup.start(Arc::clone(built.world.model()), state)?;
    let mut command = Command::stay(world.model(), top);
    let (low, high) = task.open_box("box_a").context("balls has a box A")?.inner_volume();
    let mut escaped: f64 = 0.0;
    for t in ends_of_steps(5.0, setup.dt_s) {
        let (sink, sinking) = ramp((t - 0.5) / 1.5);
        let (rise, rising) = ramp((t - 3.2) / 1.5);
        let depth = 0.32;
        command.sigma[0] = ramp((t - 2.2) / 0.8).0;
        command.base = risen(top, depth * (rise - sink), depth * (rising - sinking) / 1.5);
        recorder.step(&mut *world, &command)?;
        for pose in &world.state().objects {
            let p = pose.translation;
            if p.z < high[2] {
                for axis in 0..2 {
                    escaped = escaped.max(low[axis] - p[axis]).max(p[axis] - high[axis]);
                }
            }
            escaped = escaped.max(-p.z);
        }
    }
    Ok(recorder.finding(Figure::bounded("farthest ball centre beyond a wall", escaped * 1e3, "mm", 0.0)))
}
