//! Cases at steps from a start, several at a time; what is finished is not played again.

use super::finished::Finished;
use super::played::{Point, Row, play};
use super::scenes::Scene;
use crate::cases::Setup;
use anyhow::Result;
use parking_lot::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

/// A case from one start.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    /// The case.
    pub(crate) scene: &'static Scene,
    /// Its start, as of `case`.
    pub(crate) start: u32,
    /// Its steps, s.
    pub(crate) steps_s: Vec<f64>,
}

/// A finished job, for the progress.
pub(crate) struct Ended<'a> {
    /// The job.
    pub(crate) job: &'a Job,
    /// Its points, by steps.
    pub(crate) points: &'a [Point],
    /// Number of finished jobs, and of all.
    pub(crate) place: (usize, usize),
    /// Its time, s.
    pub(crate) took_s: f64,
}

/// Plays jobs, `threads` at a time, and returns their points in the order of the jobs.
///
/// # Errors
/// A case has no bound, or the file of finished runs cannot be written.
pub(crate) fn play_all(
    jobs: &[Job],
    threads: usize,
    finished: &Finished,
    ended: impl Fn(Ended) + Sync,
) -> Result<Vec<Row>> {
    let (next, done, rows) = (AtomicUsize::new(0), AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || -> Result<()> {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(k) else { return Ok(()) };
            let begun = Instant::now();
            let points = points(job, finished)?;
            let place = (done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len());
            ended(Ended { job, points: &points, place, took_s: begun.elapsed().as_secs_f64() });
            rows.lock().push((k, Row { scene: job.scene, points }));
        }
    };
    thread::scope(|scope| {
        let threads: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
        threads.into_iter().try_for_each(|thread| match thread.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })?;
    let mut rows = rows.into_inner();
    rows.sort_by_key(|(k, _)| *k);
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}

fn points(job: &Job, finished: &Finished) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    for &dt_s in &job.steps_s {
        if let Some(known) = finished.get(job.scene, job.start, dt_s) {
            points.push(known);
            continue;
        }
        let point = play(job.scene, &Setup { start: job.start, ..Setup::own(dt_s) })?;
        finished.add(job.scene, job.start, &point)?;
        points.push(point);
    }
    Ok(points)
}
