//! The command `hard-cases`.

use super::list::{CASES, HardCase};
use super::page::{self, HardRow};
use super::peers::Peers;
use crate::machine;
use crate::record::Record;
use crate::sweep::finished::Finished;
use crate::sweep::jobs::{Ended, Job, play_all};
use crate::sweep::{scene, steps};
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::fs;
use std::path::PathBuf;
use std::thread;

/// The cases and the output.
#[derive(Args, Clone, Debug)]
pub struct HardCasesOptions {
    /// Names of the cases; all if none is given.
    names: Vec<String>,
    /// Number of steps from 0.25 to 16 ms.
    #[arg(long, default_value_t = 10)]
    steps: usize,
    /// Number of cases and starts that are played at a time; that of the processors if not given.
    #[arg(long)]
    threads: Option<usize>,
    /// Write the page to this file instead of printing it.
    #[arg(long)]
    write: Option<PathBuf>,
    /// File of the finished runs: what was stopped goes on from there, if the program is of the same commit.
    #[arg(long, default_value = "target/sweep.jsonl")]
    runs: PathBuf,
}

impl HardCasesOptions {
    /// Plays the cases and writes the page.
    ///
    /// # Errors
    /// There is no such hard case, a report of other engines cannot be read, or a file cannot be written.
    pub fn run(&self) -> Result<()> {
        for name in &self.names {
            ensure!(CASES.iter().any(|hard| hard.case == name), "no hard case `{name}`");
        }
        let wanted =
            |hard: &&HardCase| self.names.is_empty() || self.names.iter().any(|name| name == hard.case);
        let cases: Vec<&'static HardCase> = CASES.iter().filter(wanted).collect();
        let peers = Peers::read()?;
        let record = Record::now("hard")?.line().to_string();
        let text = page::page(&record, &steps(self.steps), &self.rows(&cases)?, &peers);
        match &self.write {
            Some(path) => fs::write(path, text).with_context(|| format!("cannot write {}", path.display())),
            None => {
                print!("{text}");
                Ok(())
            }
        }
    }

    /// Plays the cases from all their starts, or takes what is finished.
    fn rows(&self, cases: &[&'static HardCase]) -> Result<Vec<HardRow>> {
        let mut jobs = Vec::new();
        for hard in cases {
            let scene = scene(hard.case).with_context(|| format!("no gate bounds a case `{}`", hard.case))?;
            let mut steps_s = steps(self.steps);
            // A step may be off by rounding.
            let (low, high) = (hard.steps_s.0 * (1.0 - 1e-9), hard.steps_s.1 * (1.0 + 1e-9));
            steps_s.retain(|dt_s| (low..=high).contains(dt_s));
            jobs.extend((0..hard.starts.count()).map(|start| Job { scene, start, steps_s: steps_s.clone() }));
        }
        let finished = Finished::open(&self.runs, &machine::commit())?;
        let threads = self.threads.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from));
        let mut played = play_all(&jobs, threads, &finished, |ended| progress(&ended))?.into_iter();
        let mut rows = Vec::new();
        for &hard in cases {
            rows.push(HardRow { hard, starts: played.by_ref().take(hard.starts.count() as usize).collect() });
        }
        Ok(rows)
    }
}

/// Says on stderr what has been played.
fn progress(ended: &Ended) {
    let Ended { job, place: (done, count), took_s, .. } = ended;
    eprintln!("{done} of {count}: {} from start {}, {took_s:.1} s", job.scene.name, job.start);
}
