//! A scene, and what drives it, for MuJoCo's own programs.

use super::{MuJoCo, Settings};
use crate::engine::interface::Engine;
use anyhow::Result;
use palmares_sim::{Command, Model, State};
use serde::Serialize;
use std::sync::Arc;

/// A scene as MuJoCo takes it.
#[derive(Debug, Serialize)]
pub struct Exported {
    /// An MJCF document.
    #[serde(skip)]
    pub xml: String,
    /// Positions to begin from, as MuJoCo numbers them.
    pub qpos: Vec<f64>,
    /// Velocities to begin from.
    pub qvel: Vec<f64>,
    /// What drove it: a row of set points for each step.
    pub ctrl: Vec<Vec<f64>>,
}

/// Lets MuJoCo play a scene under some commands, one for each step, and keeps what went into it.
///
/// # Errors
/// The scene has no MuJoCo equivalent, or MuJoCo is not there.
pub fn export(
    model: Arc<Model>,
    state: State,
    settings: &Settings,
    commands: &[Command],
) -> Result<Exported> {
    let mut engine = MuJoCo::new(model, state, settings)?;
    let (qpos, qvel) = engine.positions();
    let mut ctrl = Vec::with_capacity(commands.len());
    for command in commands {
        // What moves the motors: asked of a copy of the state, for the step itself moves them, too.
        let before = engine.state.clone();
        ctrl.push(engine.control(command));
        engine.state = before;
        engine.step(command)?;
    }
    Ok(Exported { xml: engine.document.xml, qpos, qvel, ctrl })
}
