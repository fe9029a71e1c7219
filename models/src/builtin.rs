//! Built-in hands.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use crate::error::ModelError;
use crate::hand::Hand;
use crate::read::{self, LoadOptions};

/// Files of a built-in hand; embedded, so that the program runs from anywhere.
struct Files {
    folder: &'static str,
    urdf: &'static str,
    settings: &'static str,
    readme: &'static str,
    /// Differences from the settings, if any.
    changes: Option<&'static str>,
}

macro_rules! files {
    ($folder:literal) => {
        Files {
            folder: $folder,
            urdf: include_str!(concat!("../hands/", $folder, "/hand.urdf")),
            settings: include_str!(concat!("../hands/", $folder, "/hand.toml")),
            readme: include_str!(concat!("../hands/", $folder, "/README.md")),
            changes: None,
        }
    };
}

/// New hands come last: the first one is the default of some tools.
const FILES: &[Files] = &[
    files!("softhand"),
    Files { changes: Some(include_str!("../hands/softhand/skin.toml")), ..files!("softhand") },
    files!("reflex"),
    files!("pinch"),
    files!("yale_t42"),
    files!("yale_model_o"),
    files!("rbo2"),
    files!("allegro"),
    files!("leap"),
    files!("inspire_rh56"),
    files!("barrett_bh282"),
    files!("shadow"),
    files!("softhand2"),
    files!("robotiq_3f"),
    files!("robotiq_2f85"),
    files!("ihy"),
    Files { changes: Some(include_str!("../hands/softhand/strong.toml")), ..files!("softhand") },
];

/// All built-in hands, loaded once.
///
/// # Panics
/// Never in a build whose tests pass: the files are part of the program, and a test loads them all.
pub fn builtin_hands() -> &'static [Arc<Hand>] {
    static HANDS: OnceLock<Vec<Arc<Hand>>> = OnceLock::new();
    HANDS.get_or_init(|| {
        FILES
            .iter()
            .map(|files| Arc::new(files.load().unwrap_or_else(|error| panic!("embedded hand: {error}"))))
            .collect()
    })
}

/// The texts of a built-in hand: `hand.urdf`, and `hand.toml` with its changes.
pub fn builtin_texts(name: &str) -> Option<(&'static str, String)> {
    let index = builtin_hands().iter().position(|hand| hand.name == name)?;
    let files = FILES.get(index)?;
    Some((files.urdf, files.settings()))
}

/// Variants of built-in hands that are guesses, as changes of their settings: (hand, variant, changes).
const VARIANTS: &[(&str, &str, &str)] =
    &[("softhand", "rubbing", include_str!("../hands/softhand/rubbing.toml"))];

/// Names of the variants of a built-in hand.
pub fn builtin_variants(name: &str) -> impl Iterator<Item = &'static str> {
    VARIANTS.iter().filter(move |variant| variant.0 == name).map(|variant| variant.1)
}

/// The settings of a variant of a built-in hand, whose name is `{name}_{variant}`, and where its numbers come from.
pub fn builtin_variant(name: &str, variant: &str) -> Option<(String, String)> {
    let (_, settings) = builtin_texts(name)?;
    let changes = VARIANTS.iter().find(|known| known.0 == name && known.1 == variant)?.2;
    let about = changes.lines().map_while(|line| line.strip_prefix("# ")).collect::<Vec<_>>().join("\n");
    Some((joined(&settings, changes), about))
}

impl Files {
    fn settings(&self) -> String {
        match self.changes {
            None => self.settings.to_owned(),
            Some(changes) => joined(self.settings, changes),
        }
    }

    fn load(&self) -> Result<Hand, ModelError> {
        let (urdf_file, settings_file) =
            (format!("hands/{}/hand.urdf", self.folder), format!("hands/{}/hand.toml", self.folder));
        let settings = self.settings();
        let loaded = read::from_text(
            (Path::new(&urdf_file), self.urdf),
            Some((Path::new(&settings_file), &settings)),
            None,
            &LoadOptions::default(),
        )?;
        Ok(loaded.hand)
    }
}

/// Where the numbers of a built-in hand come from: the table of sources in its README, one line each, without links.
pub fn sources(name: &str) -> Vec<String> {
    let Some(k) = builtin_hands().iter().position(|hand| hand.name == name) else { return Vec::new() };
    let section = FILES[k].readme.split("\n## ").find(|section| section.starts_with("Sources\n"));
    let rows = section.into_iter().flat_map(str::lines).filter(|line| line.starts_with("| ")).skip(1);
    rows.filter_map(|row| Some(row.trim_matches(['|', ' ']).split_once(" | ")?.1.replace(['*', '`'], "")))
        .filter(|source| !source.starts_with("by this project"))
        .collect()
}

/// Result of the recipe of a built-in hand in the task `grasp`, which `client-py/benchmarks/hand_grasps.py` measures.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Grasped {
    /// Mean score over the graspable objects, of 10 points.
    pub mean: f64,
    /// Graspable objects: held through the shake in half of their scenes or more.
    pub held: Vec<String>,
    /// Other objects of the task.
    pub not_held: Vec<String>,
    /// Runs, over all objects.
    pub runs: usize,
}

/// The measured grasps of a built-in hand.
///
/// # Panics
/// Never in a build whose tests pass: the file is part of the program, and a test reads it.
pub fn grasped(name: &str) -> Option<Grasped> {
    static GRASPS: OnceLock<BTreeMap<String, Grasped>> = OnceLock::new();
    let grasps = GRASPS.get_or_init(|| {
        toml::from_str(include_str!("../hands/grasps.toml"))
            .unwrap_or_else(|error| panic!("grasps.toml: {error}"))
    });
    grasps.get(name).cloned()
}

/// Merges changes into settings: tables are merged, everything else is replaced. The reader reports text that
/// is no TOML.
fn joined(settings: &str, changes: &str) -> String {
    fn join(into: &mut toml::Table, changes: toml::Table) {
        for (key, value) in changes {
            match (into.get_mut(&key), value) {
                (Some(toml::Value::Table(into)), toml::Value::Table(changes)) => join(into, changes),
                (_, value) => {
                    into.insert(key, value);
                }
            }
        }
    }
    match (settings.parse::<toml::Table>(), changes.parse()) {
        (Ok(mut table), Ok(changes)) => {
            join(&mut table, changes);
            table.to_string()
        }
        _ => format!("{settings}\n{changes}"),
    }
}

impl Hand {
    /// The built-in hand of that name.
    pub fn builtin(name: &str) -> Option<Arc<Hand>> {
        builtin_hands().iter().find(|hand| hand.name == name).cloned()
    }
}
