//! The passes of a report: outcomes, starts and times.

use super::comparison::{Run, Starts};
use super::job::Job;
use super::outcome_cache::OutcomeCache;
use crate::child::{Failure, Task};
use crate::engine::{EngineKind, Recording};
use crate::played::Played;
use anyhow::Result;
use palmares_bench::case_report::Times;
use palmares_bench::cases::Setup;
use palmares_bench::engine::limit;
use palmares_bench::recorder::Recorder;
use parking_lot::Mutex;
use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Scenes with chaotic outcomes: a tenth of a millimetre in the start changes them. They are judged by many starts. In the
/// grasps the difference from an engine's own fine run does not fall with the step; heaps are chaotic too.
pub(super) const BY_STARTS: [&str; 4] =
    ["softhand_cylinder", "softhand_box", "softhand_balls", "thirty_objects_and_hand"];

/// Number of starts of each.
pub(super) const STARTS: u32 = 8;
/// Number in a quick report, at steps below 1 ms, which would take as long as all others together, if these
/// agree.
pub(super) const FEW_STARTS: u32 = 4;

/// A timing run ends after this much CPU time, s; a grasp takes less. The second is that of a quick report.
pub(super) const LONGEST_S: f64 = 1.0;
const QUICK_LONGEST_S: f64 = 0.5;

/// A run is not timed again once it has taken this much wall time, s.
pub(super) const ENOUGH_S: f64 = 1.0;

/// Number of runs at once while the engines take turns with their timings: MuJoCo and Drake have a process for each.
pub(super) const TURNS: usize = 4;

/// Options of the runs.
#[derive(Clone, Copy)]
pub(super) struct Conduct<'a> {
    pub steps_ms: &'a [f64],
    pub repeats: usize,
    pub jobs: Option<usize>,
    pub quick: bool,
    pub run_limit_s: f64,
}

/// Step of the reference runs of cases without an analytic answer, s. Peers take up to half a millisecond of
/// CPU a step with a hand, so their references are coarser: a fifth to a tenth of their finest step.
pub(super) fn reference_s(engine: EngineKind, quick: bool) -> f64 {
    match (engine, quick) {
        (EngineKind::Own, false) => 2e-5,
        (EngineKind::MuJoCo(_), false) => 5e-5,
        (EngineKind::Rapier(_) | EngineKind::Drake(_), false) => 1e-4,
        (EngineKind::Rapier(_), true) => 1e-3,
        (_, true) => 2e-4,
    }
}

/// Number of starts from which a run of a case is played.
pub(super) fn starts(case: &str, dt_ms: f64, quick: bool) -> u32 {
    match BY_STARTS.contains(&case) {
        true if quick || dt_ms < 1.0 => FEW_STARTS,
        true => STARTS,
        false => 1,
    }
}

/// The outcome of every job at every step, in their order.
pub(super) fn outcomes(
    jobs: &[Job],
    conduct: Conduct,
    kept: OutcomeCache,
    progress: &Mutex<Progress>,
) -> Result<Vec<Vec<Run>>> {
    let kept = Mutex::new(kept);
    let failed = Mutex::new(None);
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Vec<Run>>> = jobs.iter().map(|_| Mutex::default()).collect();
    let work = || {
        while let Some(at) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|at| *at < jobs.len()) {
            let job = &jobs[at];
            let runs = (0..conduct.steps_ms.len()).map(|step| {
                let known = kept.lock().get(job, step, conduct.steps_ms[step]);
                let run = match known {
                    Some(run) => run,
                    None => {
                        let mut run = outcome(job, step, conduct)?;
                        run.starts = from_starts(job, &run, conduct)?;
                        run.unfinished |= run.starts.is_some_and(Starts::undecided);
                        kept.lock().add(&run)?;
                        run
                    }
                };
                progress.lock().line("error", &run, &said(&run));
                Ok(run)
            });
            match runs.collect() {
                Ok(runs) => *done[at].lock() = runs,
                Err(error) => {
                    *failed.lock() = Some(error);
                    next.store(jobs.len(), Ordering::Relaxed);
                }
            }
        }
    };
    let threads = || std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..conduct.jobs.unwrap_or_else(threads).max(1) {
            scope.spawn(work);
        }
    });
    if let Some(error) = failed.into_inner() {
        return Err(error);
    }
    Ok(done.into_iter().map(|runs| runs.into_inner()).collect())
}

/// One run for its outcome, with a reference run where it needs one.
fn outcome(Job { case, kind, scene, keys, .. }: &Job, step: usize, conduct: Conduct) -> Result<Run> {
    let (kind, dt_ms) = (*kind, conduct.steps_ms[step]);
    let reference_dt_s = Some(reference_s(kind, conduct.quick));
    let task = Task::Case { name: case.name.to_owned(), reference_dt_s, start: 0 };
    let mut run = Run::begun(case.name, kind, dt_ms, scene, keys.get(step).cloned());
    match task.play(kind, 1e-3 * dt_ms, conduct.run_limit_s)? {
        Ok(Played { error, invariants, trouble }) => {
            (run.error, run.invariants, run.trouble) = (Some(error), invariants, trouble);
        }
        Err(Failure { said, unfinished, not_played }) => {
            (run.unfinished, run.not_played) = (unfinished, not_played);
            run.trouble = Some(said.lines().next().unwrap_or("failed").to_owned());
        }
    }
    Ok(run)
}

/// The same from other starts, where the scene is judged by them; the run itself counts as the first.
fn from_starts(Job { case, kind, .. }: &Job, first: &Run, conduct: Conduct) -> Result<Option<Starts>> {
    let count = starts(case.name, first.dt_ms, conduct.quick);
    if count == 1 || first.unfinished || first.not_played {
        return Ok(None);
    }
    let depth = |mm: Option<f64>| mm.unwrap_or(f64::INFINITY);
    let mut all = vec![(first.trouble.is_none(), depth(first.invariants.max_penetration_mm))];
    let mut unfinished = 0;
    for start in 1..count {
        let task = Task::Case { name: case.name.to_owned(), reference_dt_s: None, start };
        match task.play::<Played>(*kind, 1e-3 * first.dt_ms, conduct.run_limit_s)? {
            Ok(played) => all.push((played.trouble.is_none(), depth(played.invariants.max_penetration_mm))),
            Err(failure) if failure.unfinished => unfinished += 1,
            Err(_) => all.push((false, f64::INFINITY)),
        }
        if start + 1 == FEW_STARTS && unfinished == 0 && all.iter().all(|(done, _)| *done == all[0].0) {
            break;
        }
    }
    let mut overlaps: Vec<f64> = all.iter().map(|(_, overlap)| *overlap).collect();
    overlaps.sort_by(f64::total_cmp);
    Ok(Some(Starts {
        tried: all.len() as u32,
        unfinished,
        done: all.iter().filter(|(done, _)| *done).count() as u32,
        median_overlap_mm: Some(overlaps[overlaps.len() / 2]).filter(|mm| mm.is_finite()),
    }))
}

/// Runs for the clock alone, one at a time, only of runs that solve their scene and have no kept time. The engines take turns: if
/// the machine is slower for a while, it is slower for all.
pub(super) fn timings(jobs: &[Job], runs: &mut [Vec<Run>], conduct: Conduct, progress: &Mutex<Progress>) {
    let mut by_case: Vec<Vec<(&Job, &mut Vec<Run>)>> = Vec::new();
    for (job, runs) in jobs.iter().zip(runs) {
        match by_case.last_mut().filter(|last| last[0].0.case.name == job.case.name) {
            Some(last) => last.push((job, runs)),
            None => by_case.push(vec![(job, runs)]),
        }
    }
    for mut of_case in by_case {
        for step in 0..conduct.steps_ms.len() {
            let here = of_case.iter_mut().map(|(job, runs)| (*job, &mut runs[step]));
            // The time to lose an object is of no interest.
            let (mut timed, others): (Vec<_>, Vec<_>) =
                here.partition(|(_, run)| run.does_it() && run.cpu_s == 0.0);
            progress.lock().done += others.len();
            while !timed.is_empty() {
                let rest = timed.split_off(timed.len().min(TURNS));
                for run in turns(timed, conduct) {
                    progress.lock().line("time", run, &format!("{:.3} ms of CPU a second", 1e3 * run.cpu_s));
                }
                timed = rest;
            }
        }
    }
}

/// Times at most [`TURNS`] runs, by turns.
pub(super) fn turns<'a>(runs: Vec<(&Job, &'a mut Run)>, conduct: Conduct) -> Vec<&'a mut Run> {
    let longest_s = if conduct.quick { QUICK_LONGEST_S } else { LONGEST_S };
    let within = |run: &mut dyn FnMut() -> Option<Times>| limit::within(conduct.run_limit_s, run);
    let mut clocks = Vec::new();
    for (Job { case, kind, .. }, run) in runs {
        let setup = Setup::new(kind.factory(), 1e-3 * run.dt_ms);
        let mut play = move || {
            let mut recorder = Recorder::for_at_most(longest_s);
            let finished = (case.run)(&setup, &mut recorder).is_ok();
            (finished || recorder.broke_off() || limit::used_up()).then(|| recorder.times())
        };
        let clock: Box<dyn FnMut() -> Option<Times>> = if kind.has_process() {
            let (first, mut recording) = Recording::of(|| within(&mut play));
            Box::new(move || {
                let total = 1e6 * recording.replay(longest_s).ok()?;
                Some(Times { total, ..first? })
            })
        } else {
            Box::new(move || within(&mut play))
        };
        clocks.push((run, clock, Vec::new(), 0.0));
    }
    for _ in 0..conduct.repeats {
        for (_, clock, times, spent_s) in clocks.iter_mut().filter(|(.., spent_s)| *spent_s < ENOUGH_S) {
            let begin = Instant::now();
            times.extend(clock());
            *spent_s += begin.elapsed().as_secs_f64();
        }
    }
    let finish = |(run, _, mut times, _): (&'a mut Run, _, Vec<Times>, f64)| {
        if times.is_empty() {
            run.trouble = Some("did not run a second time".into());
            return run;
        }
        times.sort_by(|a, b| a.total.total_cmp(&b.total));
        // µs a step are ms of CPU a simulated second at 1 ms.
        let cpu = |total_us: f64| total_us * 1e-3 / run.dt_ms;
        run.us_per_step = median(&times);
        run.cpu_s_between = [cpu(times[0].total), cpu(times[times.len() - 1].total)];
        run.cpu_s = cpu(run.us_per_step.total);
        run
    };
    clocks.into_iter().map(finish).collect()
}

/// The middle one of sorted times, of an even number the mean of the middle two.
fn median(times: &[Times]) -> Times {
    let [low, high] = [times[(times.len() - 1) / 2], times[times.len() / 2]];
    let mean = |of: fn(&Times) -> f64| (of(&low) + of(&high)) / 2.0;
    Times {
        dynamics: mean(|it| it.dynamics),
        collision: mean(|it| it.collision),
        solver: mean(|it| it.solver),
        total: mean(|it| it.total),
        worst: mean(|it| it.worst),
    }
}

fn said(run: &Run) -> String {
    let figure = run.error.as_ref().and_then(|figure| Some((figure.value?, &figure.unit)));
    let error = figure.map_or_else(String::new, |(value, unit)| format!("{value:.2e} {unit}"));
    let starts = run
        .starts
        .map_or_else(String::new, |starts| format!("; from {} of {} starts", starts.done, starts.tried));
    match &run.trouble {
        Some(trouble) => format!("{error} ({trouble}){starts}"),
        None => error + &starts,
    }
}

/// Progress of a report.
pub(super) struct Progress {
    pub begin: Instant,
    pub done: usize,
    pub all: usize,
}

impl Progress {
    fn line(&mut self, pass: &str, run: &Run, said: &str) {
        self.done += 1;
        let spent = self.begin.elapsed().as_secs_f64();
        let left = spent / self.done as f64 * (self.all - self.done) as f64;
        let Run { case, engine, settings, dt_ms, .. } = run;
        let Progress { done, all, .. } = self;
        println!(
            "[{done:>4}/{all}] {spent:>5.0} s, about {left:.0} s left | {pass:<5} {case} {engine} {settings} {dt_ms} ms: {said}"
        );
        let _ = std::io::stdout().flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_two_times_is_their_mean() {
        let times = [1.0, 3.0, 8.0].map(|total| Times { total, ..Times::default() });
        assert_eq!(median(&times[..2]).total, 2.0);
        assert_eq!(median(&times).total, 3.0);
        assert_eq!(median(&times[..1]).total, 1.0);
    }
}
