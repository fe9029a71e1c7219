//! The command `sweep`.

use super::finished::Finished;
use super::played::{Point, Row, outliers, play, scene, steps, worst};
use super::scenes::{SCENES, Scene};
use super::{map, page};
use crate::cases::Setup;
use crate::machine;
use crate::record::Record;
use anyhow::{Context, Result, ensure};
use clap::Args;
use parking_lot::Mutex;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

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
        let (next, done, rows) = (AtomicUsize::new(0), AtomicUsize::new(0), Mutex::new(Vec::new()));
        let work = || -> Result<()> {
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some(&scene) = scenes.get(k) else { return Ok(()) };
                let begun = Instant::now();
                let points = self.points(scene, &finished)?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress(scene, &points, (done, scenes.len()), begun.elapsed().as_secs_f64());
                rows.lock().push((k, Row { scene, points }));
            }
        };
        thread::scope(|scope| {
            let threads: Vec<_> = (0..self.threads.max(1)).map(|_| scope.spawn(work)).collect();
            threads.into_iter().try_for_each(|thread| match thread.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        let mut rows = rows.into_inner();
        rows.sort_by_key(|(k, _)| *k);
        Ok(rows.into_iter().map(|(_, row)| row).collect())
    }

    fn points(&self, scene: &Scene, finished: &Finished) -> Result<Vec<Point>> {
        let mut points = Vec::new();
        for dt_s in steps(self.steps) {
            if let Some(known) = finished.get(scene, self.start, dt_s) {
                points.push(known);
                continue;
            }
            let point = play(scene, &Setup { start: self.start, ..Setup::own(dt_s) })?;
            finished.add(scene, self.start, &point)?;
            points.push(point);
        }
        Ok(points)
    }
}

/// Says on stderr what has been played.
fn progress(scene: &Scene, points: &[Point], (done, count): (usize, usize), took_s: f64) {
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
