//! Built-in hands.

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
    /// Differences from the settings, if any.
    changes: Option<&'static str>,
}

const SOFTHAND: Files = Files {
    folder: "softhand",
    urdf: include_str!("../hands/softhand/hand.urdf"),
    settings: include_str!("../hands/softhand/hand.toml"),
    changes: None,
};

const FILES: [Files; 4] = [
    SOFTHAND,
    Files { changes: Some(include_str!("../hands/softhand/skin.toml")), ..SOFTHAND },
    Files {
        folder: "reflex",
        urdf: include_str!("../hands/reflex/hand.urdf"),
        settings: include_str!("../hands/reflex/hand.toml"),
        changes: None,
    },
    Files {
        folder: "pinch",
        urdf: include_str!("../hands/pinch/hand.urdf"),
        settings: include_str!("../hands/pinch/hand.toml"),
        changes: None,
    },
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
