//! Finished runs of a sweep, kept in a file: a sweep that is stopped goes on from there.

use super::played::Point;
use super::scenes::Scene;
use anyhow::{Context, Result};
use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
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
pub(super) struct Finished {
    commit: String,
    known: BTreeMap<Key, Line>,
    log: Mutex<File>,
}

impl Finished {
    /// Reads the runs of this commit. A program with changed files has no commit: its runs are played again.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub(super) fn open(path: &Path, commit: &str) -> Result<Self> {
        let mut known = BTreeMap::new();
        for line in fs::read_to_string(path).unwrap_or_default().lines() {
            // The last line may have been cut off when the program was stopped.
            let Ok(line) = serde_json::from_str::<Line>(line) else { continue };
            if line.commit == commit && !commit.ends_with('+') {
                known.insert(key(&line.case, line.start, line.dt_s), line);
            }
        }
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let mut log = OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .with_context(|| format!("cannot write {}", path.display()))?;
        // Ends a line that was cut off.
        writeln!(log)?;
        Ok(Finished { commit: commit.to_owned(), known, log: Mutex::new(log) })
    }

    /// The run of a scene at a step, if it is finished.
    pub(super) fn get(&self, scene: &Scene, start: u32, dt_s: f64) -> Option<Point> {
        let line = self.known.get(&key(scene.name, start, dt_s))?;
        Some(Point { dt_s, figure: line.figure.unwrap_or(f64::INFINITY), bound: line.bound })
    }

    /// Keeps a run.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn add(&self, scene: &Scene, start: u32, point: &Point) -> Result<()> {
        let line = Line {
            commit: self.commit.clone(),
            case: scene.name.to_owned(),
            start,
            dt_s: point.dt_s,
            figure: Some(point.figure).filter(|it| it.is_finite()),
            bound: point.bound,
        };
        // In one piece, so that lines of several threads stay whole.
        let text = serde_json::to_string(&line)? + "\n";
        Ok(self.log.lock().write_all(text.as_bytes())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::played::scene;

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
        fs::write(&file, fs::read_to_string(&file).expect("text") + "{\"commit\":\"abc").expect("cut off");
        for (commit, start, known) in
            [("abc", 0, true), ("abc", 1, false), ("def", 0, false), ("abc+", 0, false)]
        {
            let finished = Finished::open(&file, commit).expect("a file");
            for point in points {
                assert_eq!(finished.get(palm, start, point.dt_s), known.then_some(point), "{commit} {start}");
            }
        }
        // The line that was cut off does not spoil the next one.
        let last = Point { dt_s: 5e-3, figure: 2.0, bound: 1.0 };
        Finished::open(&file, "abc").expect("a file").add(palm, 0, &last).expect("written");
        assert_eq!(Finished::open(&file, "abc").expect("a file").get(palm, 0, 5e-3), Some(last));
        fs::remove_dir_all(folder).expect("removed");
    }
}
