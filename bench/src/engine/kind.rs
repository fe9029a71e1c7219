//! The engines that there are, each with its named settings.

use super::interface::Engine;
use super::limit::Limited;
use super::{mujoco, own, rapier};
use anyhow::{Context, Result, bail, ensure};
use palmares_models::hand::Hand;
use palmares_sim::{Model, State, World};
use std::sync::Arc;

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

    /// Whether each of its steps surely comes to an end: rapier does not return from some.
    pub fn always_returns(self) -> bool {
        !matches!(self, EngineKind::Rapier(_))
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
