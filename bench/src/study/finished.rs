//! Finished runs in a file: a study that is stopped goes on from there.

use super::played::{Played, micros};
use super::scenes::{KnownScene, SceneRow};
use super::subject::Subject;
use crate::run_log::{RunLog, is_of_commit};
use anyhow::Result;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A line of the file.
#[derive(Serialize, Deserialize)]
enum Line {
    Scene(SceneRow),
    Subject(Played),
}

/// The finished runs of a commit.
pub(super) struct Finished {
    commit: String,
    scenes: Vec<SceneRow>,
    subjects: Vec<Played>,
    log: RunLog,
}

impl Finished {
    /// Reads those of this commit.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub(super) fn open(path: &Path, commit: &str) -> Result<Self> {
        let (log, lines) = RunLog::open::<Line>(path)?;
        let (mut scenes, mut subjects) = (Vec::new(), Vec::new());
        for line in lines {
            match line {
                Line::Scene(row) if is_of_commit(&row.commit, commit) => scenes.push(row),
                Line::Subject(played) if is_of_commit(&played.commit, commit) => subjects.push(played),
                Line::Scene(_) | Line::Subject(_) => {}
            }
        }
        Ok(Finished { commit: commit.to_owned(), scenes, subjects, log })
    }

    /// The row of a scene: that of the file, or played and kept there.
    ///
    /// # Errors
    /// As of [`KnownScene::row`], or the file cannot be written.
    pub(super) fn row(&self, scene: KnownScene) -> Result<SceneRow> {
        if let Some(known) = self.scenes.iter().find(|row| row.scene == scene.name()) {
            return Ok(known.clone());
        }
        let row = scene.row(&self.commit)?;
        self.log.add(&Line::Scene(row.clone()))?;
        Ok(row)
    }

    /// The runs of a subject at a step: those of the file, or played and kept there.
    ///
    /// # Errors
    /// As of [`Played::play`], or the file cannot be written.
    pub(super) fn played(&self, subject: Subject, dt_s: f64) -> Result<Played> {
        let (name, step_us) = (subject.name(), micros(dt_s));
        if let Some(known) = self.subjects.iter().find(|it| it.subject == name && it.step_us == step_us) {
            return Ok(known.clone());
        }
        let played = Played::play(subject, dt_s, &self.commit)?;
        self.log.add(&Line::Subject(played.clone()))?;
        Ok(played)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep;
    use std::fs;

    #[test]
    fn finished_runs_are_known_after_a_stop() {
        let folder = std::env::temp_dir().join(format!("palmares-study-{}", std::process::id()));
        let file = folder.join("study.jsonl");
        let scene = KnownScene::Case("sliding_impact");
        let subject = Subject::Case(sweep::scene("sliding_impact").expect("a scene"));
        let finished = Finished::open(&file, "abc").expect("a file");
        let row = finished.row(scene).expect("it is played");
        let played = finished.played(subject, 4e-3).expect("it is played");
        let text = fs::read_to_string(&file).expect("a file");
        let again = Finished::open(&file, "abc").expect("a file");
        let same = again.played(subject, 4e-3).expect("known");
        assert_eq!((same.steps, same.without.len()), (played.steps, played.without.len()));
        assert_eq!(again.row(scene).expect("known").laws.len(), row.laws.len());
        assert_eq!(fs::read_to_string(&file).expect("a file"), text, "nothing is played again");
        let other = Finished::open(&file, "def").expect("a file");
        assert!(other.scenes.is_empty() && other.subjects.is_empty());
        fs::remove_dir_all(folder).expect("removed");
    }
}
