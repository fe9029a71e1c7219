//! Outcomes of a report's runs, kept in a file. They do not depend on the clock, so that they can be gathered
//! in several parts while the machine does other work. Timings are never kept.

use super::comparison::Run;
use crate::engine::EngineKind;
use anyhow::Result;
use palmares_bench::run_log::{RunLog, is_of_commit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    commit: String,
    /// Whether the report is quick: its references are coarser.
    quick: bool,
    run: Run,
}

/// Case, engine, settings, step in ns.
type Key = (String, String, String, u64);

fn key(case: &str, engine: &str, settings: &str, dt_ms: f64) -> Key {
    (case.to_owned(), engine.to_owned(), settings.to_owned(), (dt_ms * 1e6).round() as u64)
}

/// The file, and its outcomes.
pub(super) struct OutcomeCache {
    commit: String,
    quick: bool,
    known: BTreeMap<Key, Run>,
    log: RunLog,
}

impl OutcomeCache {
    /// Reads the outcomes of this commit from the file; with `reuse_peers` also those of peers from any
    /// commit, which count where the scene is still the same.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub(super) fn open(file: &Path, commit: &str, quick: bool, reuse_peers: bool) -> Result<Self> {
        let mut known = BTreeMap::new();
        let (log, lines) = RunLog::open::<Line>(file)?;
        for Line { commit: of, quick: coarse, run } in lines {
            let same = is_of_commit(&of, commit);
            if coarse == quick && (same || reuse_peers && run.engine != EngineKind::Own.name()) {
                known.insert(key(&run.case, &run.engine, &run.settings, run.dt_ms), run);
            }
        }
        Ok(OutcomeCache { commit: commit.to_owned(), quick, known, log })
    }

    /// The outcome of a case with this scene, if it is known.
    pub(super) fn get(&self, case: &str, kind: EngineKind, dt_ms: f64, scene: &str) -> Option<&Run> {
        let known = self.known.get(&key(case, kind.name(), kind.settings(), dt_ms));
        known.filter(|run| run.scene.as_deref() == Some(scene))
    }

    /// Keeps an outcome.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add(&self, run: &Run) -> Result<()> {
        let line = Line { commit: self.commit.clone(), quick: self.quick, run: run.clone() };
        self.log.add(&line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn outcomes_of_the_commit_are_known_and_those_of_others_only_of_peers_and_on_request() {
        let folder = std::env::temp_dir().join(format!("palmares-kept-{}", std::process::id()));
        let file = folder.join("report.jsonl");
        let peer = EngineKind::all().find(|kind| *kind != EngineKind::Own).expect("a peer");
        let kept = OutcomeCache::open(&file, "abc", false, false).expect("a file");
        for kind in [EngineKind::Own, peer] {
            assert!(kept.get("slide_stop", kind, 2.0, "scene").is_none());
            kept.add(&Run::begun("slide_stop", kind, 2.0, "scene")).expect("written");
        }
        drop(kept);
        for (commit, quick, reuse, own, other) in [
            ("abc", false, false, true, true),
            ("abc", true, true, false, false),
            ("abc+", false, false, false, false),
            ("def", false, false, false, false),
            ("def", false, true, false, true),
        ] {
            let kept = OutcomeCache::open(&file, commit, quick, reuse).expect("a file");
            let known = |kind| kept.get("slide_stop", kind, 2.0, "scene").is_some();
            assert!(kept.get("slide_stop", peer, 2.0, "another").is_none());
            assert_eq!((known(EngineKind::Own), known(peer)), (own, other), "{commit} {quick} {reuse}");
        }
        fs::remove_dir_all(folder).expect("removed");
    }
}
