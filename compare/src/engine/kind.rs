//! The engines that there are, each with its named settings.

use super::adapter::Adapter;
use super::option_set::{self, Dimension, FoundSettings};
use super::surfaces::Surfaces;
use super::{drake, mujoco, rapier};
use anyhow::{Context, Result, bail, ensure};
use palmares_bench::engine::limit::Limited;
use palmares_bench::engine::{Engine, EngineFactory, OwnFactory};
use palmares_sim::{Model, State};
use parking_lot::Mutex;
use std::collections::BTreeMap;
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
    /// Drake, through its Python package.
    Drake(&'static drake::Settings),
}

/// The name of all drawn grasps together, where settings and searches name scenes.
pub const GRASPS: &str = "grasps";

/// What a search found for an engine.
fn found(name: &str) -> &'static [FoundSettings] {
    match name {
        "rapier" => rapier::FOUND,
        "mujoco" => mujoco::FOUND,
        _ => &[],
    }
}

impl EngineKind {
    /// Names of the engines.
    pub const NAMES: [&str; 4] = ["own", "rapier", "mujoco", "drake"];

    /// Every engine with each of the settings that reports play, ours first: the named ones, and those that a search found.
    pub fn all() -> impl Iterator<Item = EngineKind> {
        Self::NAMES.into_iter().flat_map(|name| {
            let found = found(name).iter();
            let found = found.filter_map(move |found| Self::from_names(name, Some(found.settings)).ok());
            Self::bases(name).into_iter().chain(found)
        })
    }

    /// An engine with each of its named settings; the others change options of these.
    pub fn bases(name: &str) -> Vec<EngineKind> {
        match name {
            "own" => vec![EngineKind::Own],
            "rapier" => rapier::SETTINGS.iter().map(EngineKind::Rapier).collect(),
            "mujoco" => mujoco::SETTINGS.iter().map(EngineKind::MuJoCo).collect(),
            "drake" => drake::SETTINGS.iter().map(EngineKind::Drake).collect(),
            _ => Vec::new(),
        }
    }

    /// Name of the engine, as on the command line.
    pub fn name(self) -> &'static str {
        self.factory().name()
    }

    /// Name of its settings, as on the command line.
    pub fn settings(self) -> &'static str {
        self.factory().settings()
    }

    /// Whether each of its steps ends: rapier does not return from some. Drake's process ends with the limit of a run.
    pub fn always_returns(self) -> bool {
        !matches!(self, EngineKind::Rapier(_))
    }

    /// Whether it steps in a process of its own, which can play its steps again.
    pub fn has_process(self) -> bool {
        matches!(self, EngineKind::MuJoCo(_) | EngineKind::Drake(_))
    }

    /// Whether a report plays a scene with these settings: some are for scenes with a hand or for what bodies meet with, and those
    /// that a search found are for the scenes in which it found them.
    pub fn plays(self, case: &str, has_hand: bool, surfaces: Surfaces) -> bool {
        let found = found(self.name()).iter().find(|found| found.settings == self.settings());
        match (self, found) {
            (_, Some(found)) => found.scenes.contains(&case),
            (EngineKind::Rapier(settings), None) => has_hand || !settings.hands_alone,
            (EngineKind::MuJoCo(settings), None) => has_hand || settings.differ_in(case),
            (EngineKind::Drake(settings), None) => settings.differ_with(surfaces),
            (EngineKind::Own, None) => true,
        }
    }

    /// Whether drawn grasps are played with these settings.
    pub fn plays_grasps(self) -> bool {
        self.plays(GRASPS, true, Surfaces::default())
    }

    /// Description of these settings, with the reason to choose them.
    pub fn about_settings(self) -> &'static str {
        match self {
            EngineKind::Own => "the constants of `sim/src/config.rs`",
            EngineKind::Rapier(settings) => settings.about,
            EngineKind::MuJoCo(settings) => settings.about,
            EngineKind::Drake(settings) => settings.about,
        }
    }

    /// Every option of these settings with its value, whatever the settings are called.
    pub fn options(self) -> String {
        match self {
            EngineKind::Own => String::new(),
            EngineKind::Rapier(settings) => {
                let mut nameless = *settings;
                (nameless.name, nameless.about, nameless.hands_alone) = ("", "", false);
                format!("{nameless:?}")
            }
            EngineKind::MuJoCo(settings) => {
                let mut nameless = *settings;
                (nameless.name, nameless.about) = ("", "");
                format!("{nameless:?}")
            }
            EngineKind::Drake(settings) => {
                let mut nameless = *settings;
                (nameless.name, nameless.about) = ("", "");
                format!("{nameless:?}")
            }
        }
    }

    /// The adapter that passes scenes on to this engine; none for ours.
    pub fn adapter(self) -> Option<Adapter> {
        match self {
            EngineKind::Own => None,
            EngineKind::Rapier(_) => Some(Adapter::RAPIER),
            EngineKind::MuJoCo(_) => Some(Adapter::MUJOCO),
            EngineKind::Drake(_) => Some(Adapter::DRAKE),
        }
    }

    /// Its version.
    ///
    /// # Errors
    /// MuJoCo or Drake is not there.
    pub fn version(self) -> Result<String> {
        match self {
            EngineKind::Own => Ok(env!("CARGO_PKG_VERSION").to_owned()),
            EngineKind::Rapier(_) => Ok(rapier::VERSION.to_owned()),
            EngineKind::MuJoCo(_) => mujoco::version(),
            EngineKind::Drake(_) => drake::version(),
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

    /// From the command line: an engine and its settings, `default` where none are named; options of named ones may be
    /// [changed](super::option_set).
    ///
    /// # Errors
    /// No such engine, or it has no such settings or options.
    pub fn from_names(name: &str, settings: Option<&str>) -> Result<Self> {
        let kinds = Self::bases(name);
        ensure!(!kinds.is_empty(), "unknown engine `{name}`; known engines: {}", Self::NAMES.join(", "));
        let wanted = option_set::kept(settings.unwrap_or("default"));
        let (base, changes) = option_set::parse(wanted)?;
        let base = kinds.iter().find(|kind| kind.settings() == base).copied().with_context(|| {
            let names: Vec<&str> = kinds.iter().map(|kind| kind.settings()).collect();
            format!("unknown settings `{base}` of {name}; known settings: {}", names.join(", "))
        })?;
        if changes.is_empty() {
            return Ok(base);
        }
        static MADE: Mutex<BTreeMap<(&str, &str), EngineKind>> = Mutex::new(BTreeMap::new());
        let mut made = MADE.lock();
        if let Some(known) = made.get(&(base.name(), wanted)) {
            return Ok(*known);
        }
        let words = changes.iter().map(|(key, value)| format!("{key} {value}")).collect::<Vec<_>>();
        let about = option_set::kept(&format!("`{}` with {}", base.settings(), words.join(", ")));
        let kind = match base {
            EngineKind::Own => bail!("ours has one set of settings, without options"),
            EngineKind::Rapier(it) => {
                EngineKind::Rapier(Box::leak(Box::new(it.with(wanted, about, changes)?)))
            }
            EngineKind::MuJoCo(it) => {
                EngineKind::MuJoCo(Box::leak(Box::new(it.with(wanted, about, changes)?)))
            }
            EngineKind::Drake(it) => EngineKind::Drake(Box::leak(Box::new(it.with(wanted, about, changes)?))),
        };
        made.insert((base.name(), wanted), kind);
        Ok(kind)
    }

    /// The same with one option changed; none if it has this value already, or there is no such option.
    pub fn changed(self, option: &str, value: &str) -> Option<Self> {
        let has = match self {
            EngineKind::Own => return None,
            EngineKind::Rapier(it) => {
                it.changes.iter().find(|(key, _)| *key == option).map(|(_, value)| *value)
            }
            EngineKind::MuJoCo(it) => it.get(option),
            EngineKind::Drake(it) => it.get(option),
        };
        if has == Some(value) {
            return None;
        }
        let name = option_set::changed(self.settings(), option, value);
        Self::from_names(self.name(), Some(&name)).ok()
    }

    /// The options that a search changes.
    pub fn space(self) -> &'static [Dimension] {
        match self {
            EngineKind::Own | EngineKind::Drake(_) => &[],
            EngineKind::Rapier(_) => rapier::SPACE,
            EngineKind::MuJoCo(_) => mujoco::SPACE,
        }
    }

    /// Starts this engine with these settings.
    pub fn factory(self) -> &'static dyn EngineFactory {
        match self {
            EngineKind::Own => &OwnFactory,
            EngineKind::Rapier(settings) => settings,
            EngineKind::MuJoCo(settings) => settings,
            EngineKind::Drake(settings) => settings,
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
        Adapter::RAPIER.takes(&model)?;
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
        Adapter::MUJOCO.takes(&model)?;
        Ok(Box::new(Limited(Box::new(mujoco::MuJoCo::new(model, state, self)?))))
    }
}

impl EngineFactory for drake::Settings {
    fn name(&self) -> &'static str {
        EngineKind::NAMES[3]
    }

    fn settings(&self) -> &'static str {
        self.name
    }

    fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>> {
        Adapter::DRAKE.takes(&model)?;
        Ok(Box::new(Limited(Box::new(drake::Drake::new(model, state, self)?))))
    }
}
