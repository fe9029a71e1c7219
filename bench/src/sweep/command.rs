//! The command `sweep`.

use super::finished::Finished;
use super::jobs::{Ended, Job, play_all};
use super::played::{Point, Row, outliers, scene, steps, worst};
use super::scenes::{SCENES, Scene};
use super::{map, page};
use crate::machine;
use crate::record::Record;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::fs;
use std::path::PathBuf;

/// The cases, the steps and the output.
#[derive(Args, Clone, Debug)]
pub struct SweepOptions {
    /// Names of the cases; all with a bound if none is given.
    names: Vec<String>,
    /// Number of steps from 0.25 to 16 ms.
    #[arg(long, default_value_t = 200)]
    steps: usize,
    /// Start of the scenes, as of `case`.
    #[arg(long, default_value_t = 0)]
    start: u32,
    /// Number of cases that are played at a time.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Write the page to this file, and its map beside it, instead of printing it.
    #[arg(long)]
    write: Option<PathBuf>,
    /// File of the finished runs: a sweep that was stopped goes on from there, if the program is of the same commit.
    #[arg(long, default_value = "target/sweep.jsonl")]
    runs: PathBuf,
}

impl SweepOptions {
    /// Plays the cases and writes the page.
    ///
    /// # Errors
    /// No gate bounds a case of this name, or a file cannot be written.
    pub fn run(&self) -> Result<()> {
        for name in &self.names {
            ensure!(scene(name).is_some(), "no gate bounds a case `{name}`");
        }
        let wanted =
            |scene: &&Scene| self.names.is_empty() || self.names.iter().any(|name| name == scene.name);
        let scenes: Vec<&'static Scene> = SCENES.iter().filter(wanted).collect();
        let record = Record::now("sweep")?.line().to_string();
        let rows = self.rows(&scenes)?;
        let Some(path) = &self.write else {
            print!("{}", page::page(&record, &rows, None));
            return Ok(());
        };
        let picture = path.with_extension("svg");
        let name = picture.file_name().context("a page has a name")?.to_string_lossy().into_owned();
        for (path, text) in
            [(&picture, map::map(&page::by_distance(&rows))), (path, page::page(&record, &rows, Some(&name)))]
        {
            fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(())
    }

    /// Plays the scenes at all steps, or takes what is finished.
    fn rows(&self, scenes: &[&'static Scene]) -> Result<Vec<Row>> {
        let finished = Finished::open(&self.runs, &machine::commit())?;
        let job = |&scene: &&'static Scene| Job { scene, start: self.start, steps_s: steps(self.steps) };
        let jobs: Vec<Job> = scenes.iter().map(job).collect();
        play_all(&jobs, self.threads, &finished, |ended| progress(&ended))
    }
}

/// Says on stderr what has been played.
fn progress(ended: &Ended) {
    let &Ended { job: &Job { scene, .. }, points, place: (done, count), took_s } = ended;
    let claimed: Vec<Point> = points.iter().filter(|point| scene.claims(point.dt_s)).copied().collect();
    let worst = worst(&claimed).map_or(String::new(), |worst| {
        format!(", {} of its bound at {:.3} ms", page::part(worst.of_bound()), 1e3 * worst.dt_s)
    });
    let beyond = claimed.iter().filter(|point| point.of_bound() > 1.0).count();
    let (name, all, stand_out) = (scene.name, claimed.len(), outliers(&claimed).len());
    eprintln!(
        "{done} of {count}: {name}, {took_s:.1} s{worst}; {beyond} of {all} beyond, {stand_out} stand out"
    );
}
