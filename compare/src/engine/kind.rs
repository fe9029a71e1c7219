//! The engines that there are, each with its named settings.

use super::{mujoco, rapier};
use anyhow::{Context, Result, ensure};
use palmares_bench::engine::limit::Limited;
use palmares_bench::engine::{Engine, EngineFactory, OwnFactory};
use palmares_models::hand::Hand;
use palmares_sim::{Model, State};
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

    /// Name of the engine, as on the command line.
    pub fn name(self) -> &'static str {
        self.factory().name()
    }

    /// Name of its settings, as on the command line.
    pub fn settings(self) -> &'static str {
        self.factory().settings()
    }

    /// Whether each of its steps ends: rapier does not return from some.
    pub fn always_returns(self) -> bool {
        !matches!(self, EngineKind::Rapier(_))
    }

    /// Description of these settings, with the reason to choose them.
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

    /// Starts this engine with these settings.
    pub fn factory(self) -> &'static dyn EngineFactory {
        match self {
            EngineKind::Own => &OwnFactory,
            EngineKind::Rapier(settings) => settings,
            EngineKind::MuJoCo(settings) => settings,
        }
    }
}

impl EngineFactory for rapier::Settings {
    fn name(&self) -> &'static str {
        EngineKind::NAMES[1]
    }

    fn settings(&self) -> &'static str {
        self.name
    }

    fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        has_constant_moment_arms(self.name(), &model)?;
        Ok(Box::new(Limited(Box::new(rapier::Rapier::new(model, state, self)?))))
    }
}

impl EngineFactory for mujoco::Settings {
    fn name(&self) -> &'static str {
        EngineKind::NAMES[2]
    }

    fn settings(&self) -> &'static str {
        self.name
    }

    fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        has_constant_moment_arms(self.name(), &model)?;
        Ok(Box::new(Limited(Box::new(mujoco::MuJoCo::new(model, state, self)?))))
    }
}

fn has_constant_moment_arms(engine: &str, model: &Model) -> Result<()> {
    let bent = |hand: &Arc<Hand>| hand.tendons.iter().any(|tendon| !tendon.elements.is_empty());
    ensure!(!model.hand().is_some_and(bent), "{engine} has no tendons whose R depends on q");
    let coupled = |hand: &Arc<Hand>| !(hand.springs.is_empty() && hand.linkages.is_empty());
    ensure!(
        !model.hand().is_some_and(coupled),
        "{engine} gets no springs across joints and no closed chains"
    );
    Ok(())
}
