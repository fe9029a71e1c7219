//! The command `model`.

use super::finished::Finished;
use super::page;
use super::played::{Played, STEPS_S};
use super::scenes::{KNOWN, KnownScene, SceneRow};
use super::subject::Subject;
use crate::machine;
use crate::record::Record;
use anyhow::{Context, Result, ensure};
use clap::Args;
use parking_lot::Mutex;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// The scenes and the output.
#[derive(Args, Clone, Debug)]
pub struct StudyOptions {
    /// Names of scenes, and of cases with a bound; all of them, and the grasps, if none is given.
    names: Vec<String>,
    /// Number of runs that are played at a time; as many as there are processors if not given.
    #[arg(long)]
    threads: Option<usize>,
    /// Write the page to this file instead of printing it.
    #[arg(long)]
    write: Option<PathBuf>,
    /// File of the finished runs: a study that was stopped goes on from there, if the program is of the same commit.
    #[arg(long, default_value = "target/model.jsonl")]
    runs: PathBuf,
}

/// A run to be played.
#[derive(Clone, Copy)]
enum Job {
    Row(KnownScene),
    Subject(Subject, f64),
}

/// Its result.
enum Done {
    Row(SceneRow),
    Subject(Played),
}

impl StudyOptions {
    /// Plays the scenes and writes the page.
    ///
    /// # Errors
    /// There is no scene of a name, a run fails to start, or a file cannot be written.
    pub fn run(&self) -> Result<()> {
        let jobs = self.jobs()?;
        let record = Record::now("model")?.line().to_string();
        let finished = Finished::open(&self.runs, &machine::commit())?;
        let (mut rows, mut played) = (Vec::new(), Vec::new());
        for done in self.play(&jobs, &finished)? {
            match done {
                Done::Row(row) => rows.push(row),
                Done::Subject(one) => played.push(one),
            }
        }
        let text = page::page(&record, &rows, &played);
        match &self.write {
            Some(path) => fs::write(path, text).with_context(|| format!("cannot write {}", path.display())),
            None => {
                print!("{text}");
                Ok(())
            }
        }
    }

    fn jobs(&self) -> Result<Vec<Job>> {
        let wanted = |name: &str| self.names.is_empty() || self.names.iter().any(|it| it == name);
        let rows = KNOWN.iter().filter(|scene| wanted(&scene.name())).map(|scene| Job::Row(*scene));
        let subjects = Subject::all().into_iter().filter(|subject| wanted(&subject.name()));
        let jobs: Vec<Job> =
            rows.chain(subjects.flat_map(|it| STEPS_S.map(|dt_s| Job::Subject(it, dt_s)))).collect();
        for name in &self.names {
            let known = jobs.iter().any(|job| match job {
                Job::Row(scene) => scene.name() == *name,
                Job::Subject(subject, _) => subject.name() == *name,
            });
            ensure!(known, "no scene and no case with a bound is named `{name}`");
        }
        Ok(jobs)
    }

    /// Plays the jobs on several threads, or takes what is finished; the results are in their order.
    fn play(&self, jobs: &[Job], finished: &Finished) -> Result<Vec<Done>> {
        let (next, all) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
        let work = || -> Result<()> {
            loop {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some(job) = jobs.get(k) else { return Ok(()) };
                let done = match *job {
                    Job::Row(scene) => Done::Row(finished.row(scene)?),
                    Job::Subject(subject, dt_s) => Done::Subject(finished.played(subject, dt_s)?),
                };
                let mut all = all.lock();
                all.push((k, done));
                if all.len() % 20 == 0 || all.len() == jobs.len() {
                    eprintln!("{} of {} are played", all.len(), jobs.len());
                }
            }
        };
        let cores = thread::available_parallelism().map_or(1, usize::from);
        thread::scope(|scope| {
            let threads: Vec<_> =
                (0..self.threads.unwrap_or(cores).max(1)).map(|_| scope.spawn(work)).collect();
            threads.into_iter().try_for_each(|thread| match thread.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        let mut all = all.into_inner();
        all.sort_by_key(|(k, _)| *k);
        Ok(all.into_iter().map(|(_, done)| done).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(names: &[&str]) -> StudyOptions {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        StudyOptions { names, threads: None, write: None, runs: PathBuf::new() }
    }

    #[test]
    fn scenes_are_chosen_by_name() {
        let count = |names: &[&str]| options(names).jobs().map(|jobs| jobs.len());
        // A scene has a row; a case with a bound is played at both steps.
        assert_eq!(count(&["kapla"]).expect("known"), 1);
        assert_eq!(count(&["slide_stop"]).expect("known"), STEPS_S.len());
        assert_eq!(count(&["mass_ratio"]).expect("known"), 1 + STEPS_S.len());
        assert!(count(&[]).expect("all") > KNOWN.len() + 2 * crate::sweep::SCENES.len());
        let error = count(&["kapla", "slid_stop"]).expect_err("unknown").to_string();
        assert!(error.contains("`slid_stop`"), "{error}");
    }
}
