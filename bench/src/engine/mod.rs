//! Engines that can step a scene: ours, and the peers it is compared with.
//!
//! A scene is a [`Model`] with a start [`State`]; every engine mirrors what it simulates into a [`State`], so
//! that a case is written once and judged by the same code whoever steps it.

mod clock;
pub mod limit;
pub mod mujoco;
mod own;
pub mod rapier;

use anyhow::{Context, Result, bail, ensure};
use limit::Limited;
use palmares_models::hand::Hand;
use palmares_models::{Mat3, Vec3};
use palmares_sim::{Command, Model, State, World};
use palmares_sim::{ContactForce, Outcome};
use std::sync::Arc;

/// Contacts at least this stiff, N/m, stand for rigid bodies: peers get what serves them best there.
pub const RIGID: f64 = 1e9;

/// What a step cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// CPU time of the stepping thread, less what reading the clock cost, s.
    pub total_s: f64,
    /// Wall time by phase (dynamics, collision, solver), s; zeros where the engine does not tell. Only the
    /// ratios are used.
    pub phases_s: [f64; 3],
}

/// Something that steps a scene.
pub trait Engine {
    /// The scene.
    fn model(&self) -> &Arc<Model>;
    /// One step of the length the engine was made with.
    fn step(&mut self, command: &Command) -> Result<Cost>;
    /// Poses, coordinates, velocities and tensions now.
    fn state(&self) -> &State;
    /// Sets poses and velocities by hand; the engine goes on from them.
    fn state_mut(&mut self) -> &mut State;
    /// Lets a force and a torque about its centre of mass act on an object during the next step, in the world's axes:
    /// by default as the impulse they have over it, which is what a semi-implicit engine makes of them.
    fn push(&mut self, object: usize, force: Vec3, torque: Vec3) {
        let model = Arc::clone(self.model());
        let h = model.config().step_s;
        let turn = Mat3::from_quat(self.state().objects[object].rotation);
        let kick = turn * (model.object_inertia_inverse(object) * (turn.transpose() * torque)) * h;
        let speed = force * (h / model.objects()[object].mass);
        let at = model.object_dofs(object);
        let change = speed.to_array().into_iter().chain(kick.to_array());
        for (v, change) in self.state_mut().v[at..at + 6].iter_mut().zip(change) {
            *v += change;
        }
    }
    /// How the last step went. Peers fill in the deepest overlap and whether all numbers are finite.
    fn outcome(&self) -> Outcome;
    /// Touching contacts of the last step and their forces; none where the engine does not tell.
    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        Ok(self.world().map_or(Vec::new(), |world| world.contact_forces().to_vec()))
    }
    /// Our own world, for figures that only it has (contact forces, joint residuals).
    fn world(&self) -> Option<&World> {
        None
    }
}

/// An engine with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EngineKind {
    /// Palmares, which has one.
    Own,
    /// rapier's multibody.
    Rapier(&'static rapier::Settings),
    /// MuJoCo, through its Python package.
    MuJoCo(&'static mujoco::Settings),
}

impl EngineKind {
    /// Names of the engines.
    pub const NAMES: [&str; 3] = ["own", "rapier", "mujoco"];

    /// Every engine with each of its settings, ours first.
    pub fn all() -> impl Iterator<Item = EngineKind> {
        let rapier = rapier::SETTINGS.iter().map(EngineKind::Rapier);
        let mujoco = mujoco::SETTINGS.iter().map(EngineKind::MuJoCo);
        std::iter::once(EngineKind::Own).chain(rapier).chain(mujoco)
    }

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            EngineKind::Own => Self::NAMES[0],
            EngineKind::Rapier(_) => Self::NAMES[1],
            EngineKind::MuJoCo(_) => Self::NAMES[2],
        }
    }

    /// Name of its settings, as on the command line.
    pub fn settings(self) -> &'static str {
        match self {
            EngineKind::Own => "default",
            EngineKind::Rapier(settings) => settings.name,
            EngineKind::MuJoCo(settings) => settings.name,
        }
    }

    /// What these settings are, and why anybody would choose them.
    pub fn about_settings(self) -> &'static str {
        match self {
            EngineKind::Own => "the constants of `sim/src/config.rs`",
            EngineKind::Rapier(settings) => settings.about,
            EngineKind::MuJoCo(settings) => settings.about,
        }
    }

    /// From the command line: an engine by its name, with each of its settings.
    ///
    /// # Errors
    /// No such engine.
    pub fn with_all_settings(name: &str) -> Result<Vec<Self>> {
        let kinds: Vec<Self> = Self::all().filter(|kind| kind.name() == name).collect();
        ensure!(!kinds.is_empty(), "unknown engine `{name}`; known engines: {}", Self::NAMES.join(", "));
        Ok(kinds)
    }

    /// From the command line: an engine and its settings, `default` where none are named.
    ///
    /// # Errors
    /// No such engine, or it has no such settings.
    pub fn from_names(name: &str, settings: Option<&str>) -> Result<Self> {
        let kinds = Self::with_all_settings(name)?;
        let wanted = settings.unwrap_or("default");
        kinds.iter().find(|kind| kind.settings() == wanted).copied().with_context(|| {
            let names: Vec<&str> = kinds.iter().map(|kind| kind.settings()).collect();
            format!("unknown settings `{wanted}` of {name}; known settings: {}", names.join(", "))
        })
    }

    /// An engine about to take its first step from `state`.
    pub fn start(self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        let bent = |hand: &Arc<Hand>| hand.tendons.iter().any(|tendon| !tendon.elements.is_empty());
        if !matches!(self, EngineKind::Own) && model.hand().is_some_and(bent) {
            bail!("{} has no tendons whose R depends on q", self.name());
        }
        match self {
            EngineKind::Own => Ok(Box::new(own::Own::new(World::new(model, state)))),
            EngineKind::Rapier(settings) => {
                Ok(Box::new(Limited(Box::new(rapier::Rapier::new(model, state, settings)?))))
            }
            EngineKind::MuJoCo(settings) => {
                Ok(Box::new(Limited(Box::new(mujoco::MuJoCo::new(model, state, settings)?))))
            }
        }
    }
}
