//! Finished runs in a file, one line of JSON each: what is stopped goes on from there.

use anyhow::{Context, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::Path;

/// The file.
pub struct RunLog(File);

impl RunLog {
    /// Opens the file and reads its lines. One that is no run is left out and told: the last one may have been cut off when a program
    /// was stopped.
    ///
    /// # Errors
    /// The file cannot be made or written.
    pub fn open<Line: DeserializeOwned>(path: &Path) -> Result<(Self, Vec<Line>)> {
        let mut lines = Vec::new();
        let text = fs::read_to_string(path).unwrap_or_default();
        for (k, line) in text.lines().enumerate() {
            match serde_json::from_str(line) {
                Ok(line) => lines.push(line),
                Err(_) => eprintln!("{}: line {} is not a run and is left out", path.display(), k + 1),
            }
        }
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let file = OpenOptions::new().create(true).append(true).open(path);
        let mut file = file.with_context(|| format!("cannot write {}", path.display()))?;
        if !text.is_empty() && !text.ends_with('\n') {
            // Ends a line that was cut off.
            writeln!(file)?;
        }
        Ok((RunLog(file), lines))
    }

    /// Adds a line, in one piece, so that those of several threads stay whole.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&self, line: &impl Serialize) -> Result<()> {
        let text = serde_json::to_string(line)? + "\n";
        Ok((&self.0).write_all(text.as_bytes())?)
    }
}

/// Whether a line of one commit is valid for a program of another. A program with changed files has no commit: its runs are played
/// again.
pub fn is_of_commit(line: &str, commit: &str) -> bool {
    line == commit && !commit.ends_with('+')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_was_cut_off_spoils_no_other() {
        let folder = std::env::temp_dir().join(format!("palmares-run-log-{}", std::process::id()));
        let path = folder.join("runs.jsonl");
        let (log, known) = RunLog::open::<u32>(&path).expect("a file");
        assert!(known.is_empty());
        log.add(&1).expect("written");
        drop(log);
        fs::write(&path, fs::read_to_string(&path).expect("text") + "{\"cut").expect("cut off");
        let (log, known) = RunLog::open::<u32>(&path).expect("a file");
        assert_eq!(known, vec![1]);
        log.add(&2).expect("written");
        assert_eq!(RunLog::open::<u32>(&path).expect("a file").1, vec![1, 2]);
        fs::remove_dir_all(folder).expect("removed");
    }

    #[test]
    fn changed_files_have_no_commit() {
        assert!(is_of_commit("abc", "abc"));
        assert!(!is_of_commit("abc", "def") && !is_of_commit("abc+", "abc+"));
    }
}
