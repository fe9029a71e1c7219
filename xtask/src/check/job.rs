//! Checks that run side by side: each is a program, whose output is shown when it ends.

use super::counts::{Counts, SKIPPED, Step, Tally};
use super::verdicts::{Inputs, Verdicts};
use anyhow::{Context, Result};
use std::collections::VecDeque;
use std::io::{Read, Seek};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::thread;
use std::time::Instant;

/// A check that is a program.
pub(super) struct Job {
    pub(super) name: String,
    /// How to begin it, or the reason why this machine cannot.
    pub(super) begin: Box<dyn FnOnce() -> Result<Result<Command, String>> + Send>,
    pub(super) counts: Counts,
    pub(super) inputs: Inputs,
    /// Usual time, s, for one that this machine has not run yet: long ones begin first.
    pub(super) usual_s: f64,
}

impl Job {
    pub(super) fn new(name: &str, command: Command, counts: Counts, inputs: Inputs, usual_s: f64) -> Self {
        Job { name: name.to_owned(), begin: Box::new(move || Ok(Ok(command))), counts, inputs, usual_s }
    }
}

/// Runs jobs in a number of lanes, the longest first, and shows the output of each at its end. With `quick`, jobs whose files
/// have not changed since they passed are not run.
pub(super) fn run(mut jobs: Vec<Job>, lanes: usize, verdicts: &Verdicts, quick: bool) -> Vec<Step> {
    let seconds = |job: &Job| verdicts.seconds(&job.name).unwrap_or(job.usual_s);
    jobs.sort_by(|a, b| seconds(b).total_cmp(&seconds(a)));
    let waiting = Mutex::new(VecDeque::from(jobs));
    let steps = Mutex::new(Vec::new());
    let next = || waiting.lock().ok()?.pop_front();
    let lane = || {
        while let Some(job) = next() {
            let step = one(job, verdicts, quick);
            if let Ok(mut steps) = steps.lock() {
                steps.push(step);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..lanes {
            scope.spawn(lane);
        }
    });
    steps.into_inner().unwrap_or_default()
}

fn one(job: Job, verdicts: &Verdicts, quick: bool) -> Step {
    let Job { name, begin, counts, inputs, .. } = job;
    let began = Instant::now();
    let key = verdicts.key(&inputs);
    let kept = key.as_deref().filter(|_| quick).and_then(|key| verdicts.kept(&name, key));
    if let Some(tally) = kept {
        return Step { name, took: began.elapsed(), tally };
    }
    let (tally, shown) = made(begin, counts)
        .unwrap_or_else(|error| (Tally { failed: 1, ..Tally::default() }, format!("error: {error:#}\n")));
    let took = began.elapsed();
    // One write: lanes do not mix their lines.
    print!("\n== {name}\n{shown}{tally}; {:.1} s\n", took.as_secs_f64());
    if let Err(error) = verdicts.remember(&name, key, tally, took.as_secs_f64()) {
        println!("its verdict is not kept: {error:#}");
    }
    Step { name, took, tally }
}

/// Runs a check; returns its counts and what to show of its output.
fn made(
    begin: Box<dyn FnOnce() -> Result<Result<Command, String>> + Send>,
    counts: Counts,
) -> Result<(Tally, String)> {
    let mut command = match begin()? {
        Ok(command) => command,
        Err(reason) => return Ok((SKIPPED, format!("skipped: {reason}\n"))),
    };
    // Both outputs in one file, in their order.
    let mut printed = tempfile::tempfile().context("a file for the output")?;
    command.stdin(Stdio::null()).stdout(printed.try_clone()?).stderr(printed.try_clone()?);
    let status = command.status().with_context(|| format!("cannot start {command:?}"))?;
    printed.rewind()?;
    let mut bytes = Vec::new();
    printed.read_to_end(&mut bytes)?;
    Ok(counts.read(&String::from_utf8_lossy(&bytes), status.success()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::counts::{FAILED, PASSED};

    #[test]
    fn a_job_has_its_own_output_and_a_failure_differs_from_a_job_that_cannot_run() {
        let shell = |script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]);
            command
        };
        let made = |script: &str| {
            made(
                Box::new({
                    let c = shell(script);
                    move || Ok(Ok(c))
                }),
                Counts::Whole,
            )
            .expect("made")
        };
        assert_eq!(made("echo out; echo err >&2"), (PASSED, "out\nerr\n".to_owned()));
        assert_eq!(made("echo no; exit 3"), (FAILED, "no\n".to_owned()));
        let (tally, shown) =
            super::made(Box::new(|| Ok(Err("no such program".into()))), Counts::Whole).expect("made");
        assert_eq!((tally, &*shown), (SKIPPED, "skipped: no such program\n"));
    }
}
