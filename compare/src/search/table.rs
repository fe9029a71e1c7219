//! The result of a search.

use crate::engine::{EngineKind, Surfaces};
use anyhow::{Context, Result, ensure};
use palmares_bench::record::Record;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

const FORMAT: u32 = 2;

/// The content of the page and the JSON.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Table {
    format: u32,
    /// How it was measured.
    #[serde(flatten)]
    pub record: Record,
    /// Steps, ms.
    pub steps_ms: Vec<f64>,
    /// One for each engine and scene.
    pub found: Vec<Found>,
}

/// An engine in a scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Found {
    /// The case, or `grasps`.
    pub scene: String,
    /// The engine.
    pub engine: String,
    /// Its version.
    pub version: String,
    /// Identity of what the scene asks of an engine. Plays count as long as it and the version stay.
    pub identity: String,
    /// Number of plays of a set that is played to the end.
    pub plays: usize,
    /// Sets of options that were tried: those with more plays first, then the better ones.
    pub sets: Vec<Set>,
}

/// A set of options.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Set {
    /// Its name: named settings with changed options.
    pub settings: String,
    /// Plays that solve the scene.
    pub solved: usize,
    /// Plays that ended: the worse sets play a part of them.
    pub of: usize,
    /// Further plays that did not end in their time.
    #[serde(default)]
    pub unfinished: usize,
    /// Its plays, as `kept.rs` writes them.
    pub plays: String,
}

impl Found {
    /// The sets that were played to the end.
    pub fn whole(&self) -> impl Iterator<Item = &Set> {
        self.sets.iter().filter(|set| set.of + set.unfinished >= self.plays)
    }

    /// The largest number of plays that any of these solves; none if there is no such set.
    pub fn most(&self) -> Option<usize> {
        self.whole().map(|set| set.solved).max()
    }

    /// The same of the named settings, which reports play.
    pub fn most_named(&self) -> Option<usize> {
        let named = |set: &&Set| {
            EngineKind::all().any(|kind| {
                (kind.name(), kind.settings()) == (&*self.engine, &*set.settings)
                    && kind.plays(&self.scene, true, Surfaces::default())
            })
        };
        self.whole().filter(named).map(|set| set.solved).max()
    }

    /// Sets that solve the scene in at least one play.
    pub fn solving(&self) -> impl Iterator<Item = &Set> {
        self.sets.iter().filter(|set| set.solved > 0)
    }
}

impl Table {
    pub(super) fn new(record: Record, steps_ms: Vec<f64>, found: Vec<Found>) -> Self {
        Table { format: FORMAT, record, steps_ms, found }
    }

    /// Reads a written one.
    ///
    /// # Errors
    /// No such file, or not of this format.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let table: Table = serde_json::from_str(&text)
            .with_context(|| format!("{} is no search of format {FORMAT}", path.display()))?;
        ensure!(table.format == FORMAT, "{}: format {} is not {FORMAT}", path.display(), table.format);
        Ok(table)
    }
}
