//! Finished runs of a sweep, kept in a file: a sweep that is stopped goes on from there.

use super::played::Point;
use super::scenes::Scene;
use crate::run_log::{RunLog, is_of_commit};
use anyhow::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    commit: String,
    case: String,
    start: u32,
    dt_s: f64,
    /// Infinite if there is none.
    figure: Option<f64>,
    bound: f64,
}

/// Case, start, step in ps: numbers in a file may be off by rounding.
type Key = (String, u32, u64);

fn key(case: &str, start: u32, dt_s: f64) -> Key {
    (case.to_owned(), start, (dt_s * 1e12).round() as u64)
}

/// The runs of a commit.
pub(crate) struct Finished {
    commit: String,
    known: BTreeMap<Key, Line>,
    log: RunLog,
}

impl Finished {
    /// Reads the runs of this commit.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub(crate) fn open(path: &Path, commit: &str) -> Result<Self> {
        let (log, lines) = RunLog::open::<Line>(path)?;
        let lines = lines.into_iter().filter(|line| is_of_commit(&line.commit, commit));
        let known = lines.map(|line| (key(&line.case, line.start, line.dt_s), line)).collect();
        Ok(Finished { commit: commit.to_owned(), known, log })
    }

    /// The run of a scene at a step, if it is finished.
    pub(crate) fn get(&self, scene: &Scene, start: u32, dt_s: f64) -> Option<Point> {
        let line = self.known.get(&key(scene.name, start, dt_s))?;
        Some(Point { dt_s, figure: line.figure.unwrap_or(f64::INFINITY), bound: line.bound })
    }

    /// Keeps a run.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn add(&self, scene: &Scene, start: u32, point: &Point) -> Result<()> {
        let line = Line {
            commit: self.commit.clone(),
            case: scene.name.to_owned(),
            start,
            dt_s: point.dt_s,
            figure: Some(point.figure).filter(|it| it.is_finite()),
            bound: point.bound,
        };
        self.log.add(&line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::played::scene;
    use std::fs;

    #[test]
    fn runs_of_the_commit_are_known_after_a_stop() {
        let folder = std::env::temp_dir().join(format!("palmares-sweep-{}", std::process::id()));
        let file = folder.join("sweep.jsonl");
        let palm = scene("turning_palm").expect("a scene");
        let points =
            [0.7, f64::INFINITY].map(|figure| Point { dt_s: 0.31e-3 * figure.min(2.0), figure, bound: 1.0 });
        let finished = Finished::open(&file, "abc").expect("a file");
        for point in &points {
            assert_eq!(finished.get(palm, 0, point.dt_s), None);
            finished.add(palm, 0, point).expect("written");
        }
        drop(finished);
        for (commit, start, known) in
            [("abc", 0, true), ("abc", 1, false), ("def", 0, false), ("abc+", 0, false)]
        {
            let finished = Finished::open(&file, commit).expect("a file");
            for point in points {
                assert_eq!(finished.get(palm, start, point.dt_s), known.then_some(point), "{commit} {start}");
            }
        }
        fs::remove_dir_all(folder).expect("removed");
    }
}
