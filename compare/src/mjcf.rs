//! A task's scene as a file for MuJoCo, so that others can measure the same scene.

use crate::engine::EngineKind;
use crate::engine::mujoco::export;
use anyhow::{Context, Result, bail};
use clap::Args;
use palmares_models::hand::Hand;
use palmares_sim::Command;
use palmares_tasks::{Action, BaseTarget, Run, Seed, Task};
use std::path::PathBuf;

/// Position of the motors when open and when closed.
const SIGMA: [f64; 2] = [0.1, 0.6];
const HALF_PERIOD_S: f64 = 0.25;
const PERIODS: usize = 2;

/// Scene and output.
#[derive(Args, Debug)]
pub struct MjcfOptions {
    /// Name of a task.
    #[arg(long, default_value = "balls")]
    task: String,
    /// Name of a hand.
    #[arg(long, default_value = "softhand")]
    hand: String,
    /// Seed of the scene.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time for which the hand first moves, s.
    #[arg(long, default_value_t = 0.0)]
    lead_in_s: f64,
    /// Upward speed of the hand during this time, m/s.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    lead_in_m_s: f64,
    /// Named settings of MuJoCo.
    #[arg(long, default_value = "recommended")]
    settings: String,
    /// Folder for `scene.xml` and `drive.json`: qpos, qvel, and rows of ctrl in which the hand opens and closes.
    #[arg(long)]
    out: PathBuf,
}

/// Writes the files.
///
/// # Errors
/// There is no such scene, MuJoCo does not take it, or a file cannot be written.
pub fn run(options: &MjcfOptions) -> Result<()> {
    let task = Task::builtin().into_iter().find(|task| task.name == options.task).context("no such task")?;
    let hand = Hand::builtin(&options.hand).context("no such hand")?;
    let EngineKind::MuJoCo(settings) = EngineKind::from_names("mujoco", Some(&options.settings))? else {
        bail!("these are no settings of MuJoCo");
    };
    let (tick_s, motors) = (task.tick_s, hand.motors.len());
    let mut run = Run::new(task, hand, Seed::from_u64(options.seed))?;
    for _ in 0..(options.lead_in_s / tick_s).round() as u64 {
        let linear = [0.0, 0.0, options.lead_in_m_s];
        let base = BaseTarget::Twist { linear, angular: [0.0; 3] };
        run.step(&Action { base: Some(base), hand: Some(vec![SIGMA[0]; motors]), effort: None })?;
    }
    let (model, state) = (run.world().model().clone(), run.world().state().clone());
    let half = (HALF_PERIOD_S / model.config().step_s).round() as usize;
    let commands: Vec<Command> = (0..2 * PERIODS * half)
        .map(|k| Command {
            sigma: vec![SIGMA[1 - (k / half) % 2]; motors],
            ..Command::stay(&model, state.reference.pose)
        })
        .collect();
    let exported = export(model, state, settings, &commands)?;
    std::fs::create_dir_all(&options.out)?;
    std::fs::write(options.out.join("scene.xml"), &exported.xml)?;
    std::fs::write(options.out.join("drive.json"), serde_json::to_string(&exported)?)?;
    println!("{}", options.out.display());
    Ok(())
}
