//! The finished parts, and the engine of each: a file in the target directory.

use super::declared::DeclaredPart;
use anyhow::{Context, Result};
use serde_json::{Map, Value, json};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The finished parts. Each part is written when it is finished: a stop loses none.
pub(super) struct FinishedParts {
    file: PathBuf,
    finished: Map<String, Value>,
}

impl FinishedParts {
    /// Reads the file in this folder; there is another one for quick parts.
    pub(super) fn read(folder: &Path, quick: bool) -> Result<Self> {
        let file = folder.join(if quick { "finished-quick.json" } else { "finished.json" });
        let finished = match fs::read_to_string(&file) {
            Ok(text) => serde_json::from_str(&text)
                .with_context(|| format!("{} is damaged: remove it", file.display()))?,
            Err(error) if error.kind() == ErrorKind::NotFound => Map::new(),
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", file.display())),
        };
        Ok(FinishedParts { file, finished })
    }

    /// Whether a part was finished with this fingerprint.
    pub(super) fn finished(&self, part: &str, fingerprint: &str) -> bool {
        self.finished.get(part).is_some_and(|kept| kept["fingerprint"] == fingerprint)
    }

    /// Time that a part took the last time, or usually takes; none if that is not known.
    pub(super) fn usual_minutes(&self, part: &DeclaredPart) -> Option<f64> {
        self.finished.get(&part.name).and_then(|kept| kept["took_min"].as_f64()).or(part.minutes)
    }

    /// Adds a part and writes the file.
    pub(super) fn finish(&mut self, part: &str, fingerprint: &str, took_min: f64) -> Result<()> {
        self.finished.insert(part.to_owned(), json!({ "fingerprint": fingerprint, "took_min": took_min }));
        let text = serde_json::to_string_pretty(&self.finished)? + "\n";
        // Whoever stops it meanwhile leaves the old file.
        let new = self.file.with_extension("new");
        fs::write(&new, text)
            .and_then(|()| fs::rename(&new, &self.file))
            .with_context(|| format!("cannot write {}", self.file.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_finished_until_the_engine_is_another() {
        let folder = tempfile::tempdir().expect("a folder");
        let read = |quick| FinishedParts::read(folder.path(), quick).expect("readable");
        let mut parts = read(false);
        assert!(!parts.finished("cameras", "Engine 1"));
        parts.finish("cameras", "Engine 1", 0.25).expect("written");
        let again = read(false);
        assert!(again.finished("cameras", "Engine 1"));
        assert!(!again.finished("cameras", "Engine 2") && !again.finished("report", "Engine 1"));
        assert!(!read(true).finished("cameras", "Engine 1"), "quick parts are others");
        fs::write(folder.path().join("finished.json"), "{").expect("written");
        let error = FinishedParts::read(folder.path(), false)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default();
        assert!(error.contains("remove it"), "{error}");
    }
}
