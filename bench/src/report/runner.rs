//! Runs cases over engines and steps: errors first, then timings, a line of progress for each.

use super::comparison::{Comparison, EngineNote, FORMAT, Run, trouble};
use super::dominance::verdicts;
use super::machine::{self, Machine};
use super::{Figure, Invariants, Report, Times, page, plots, ticks};
use crate::cases::{self, Case, Setup};
use crate::engine::limit::{self, NotFinished};
use crate::engine::{EngineKind, mujoco, rapier};
use crate::recorder::Recorder;
use anyhow::{Context, Result, bail, ensure};
use std::path::PathBuf;
use std::time::Instant;
use std::{fs, io::Write};

/// What to compare, and where to put it.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder of the report.
    pub out: PathBuf,
    /// Engines; ours is always among them.
    pub engines: Vec<EngineKind>,
    /// Names of cases; empty for all that belong into a report.
    pub cases: Vec<String>,
    /// Steps, ms; empty for those of the report.
    pub steps_ms: Vec<f64>,
    /// Timing runs of each.
    pub repeats: usize,
    /// Fewer cases and steps, coarser references.
    pub quick: bool,
    /// Wall time of a run of a peer, and of its reference, s; beyond it the run is listed as not finished.
    pub run_limit_s: f64,
}

/// The steps of a report, ms.
const STEPS_MS: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
const QUICK_STEPS_MS: [f64; 3] = [2.0, 4.0, 8.0];
const QUICK_CASES: [&str; 3] = ["softhand_free", "softhand_cylinder", "slide_stop"];

/// Why a case is not in a report unless it is asked for by name.
fn left_out(name: &str) -> Option<&'static str> {
    match name {
        _ if name.starts_with("self_consistency") => Some("says again, at dt/64, what the other rows say"),
        _ if name.ends_with("_60s") => Some("a minute of holding, for the gates"),
        "grasp_max_dt" => Some("searches the step itself"),
        _ => None,
    }
}

/// A timing run ends after this much CPU time, s; of a quick report.
pub(super) const LONGEST_S: f64 = 2.0;
const QUICK_LONGEST_S: f64 = 0.5;

/// ... and, of a peer, after this much wall time, s: MuJoCo's steps wait for a pipe, ours for nothing.
const TIMED_S: f64 = 20.0;

/// No run's limit is longer than this, s.
const LONGEST_LIMIT_S: f64 = 86400.0;

/// Step of the reference runs of cases without an analytic answer, s. rapier takes half a millisecond of CPU a
/// step with a hand, so that its reference is coarser: a tenth of its finest step is left.
fn reference_s(engine: EngineKind, quick: bool) -> f64 {
    match (engine, quick) {
        (EngineKind::Rapier(_), false) => 1e-4,
        (_, false) => 2e-5,
        (EngineKind::Rapier(_), true) => 1e-3,
        (_, true) => 2e-4,
    }
}

/// Runs everything and writes the report.
pub fn write(options: &Options) -> Result<Comparison> {
    ensure!(options.repeats > 0, "at least one timing run is needed");
    ensure!(
        options.run_limit_s > 0.0 && options.run_limit_s <= LONGEST_LIMIT_S,
        "a limit of {} s is out of range; it must be positive and at most a day",
        options.run_limit_s
    );
    let begin = Instant::now();
    let (machine, commit) = (Machine::here(), machine::commit());
    let engines = notes(options);
    let kinds: Vec<EngineKind> = EngineKind::all()
        .filter(|kind| *kind == EngineKind::Own || options.engines.contains(kind))
        .filter(|kind| engines.iter().any(|note| note.ran && note.name == kind.name()))
        .collect();
    let (chosen, left_out) = choose(options)?;
    let steps = match (options.steps_ms.as_slice(), options.quick) {
        ([], false) => STEPS_MS.to_vec(),
        ([], true) => QUICK_STEPS_MS.to_vec(),
        (some, _) => some.to_vec(),
    };
    let mut jobs = Vec::new();
    for case in &chosen {
        for kind in kinds.iter().filter(|kind| **kind == EngineKind::Own || case.peers) {
            jobs.extend(steps.iter().map(|dt_ms| (*case, *kind, *dt_ms)));
        }
    }
    println!("{} on {}, {} threads; commit {commit}", machine.system, machine.processor, machine.threads);
    let mut progress = Progress { begin, done: 0, all: 2 * jobs.len() };
    let mut runs = Vec::new();
    for (case, kind, dt_ms) in &jobs {
        let run = limit::within(options.run_limit_s, || error_pass(case, *kind, *dt_ms, options.quick));
        progress.line("error", &run, &said(&run));
        runs.push(run);
    }
    let longest_s = if options.quick { QUICK_LONGEST_S } else { LONGEST_S };
    for case in &chosen {
        for dt_ms in &steps {
            let here = jobs.iter().zip(&mut runs);
            let here = here.filter(|((other, _, dt), _)| other.name == case.name && dt == dt_ms);
            // How long it takes to lose an object is of no interest.
            let (timed, others): (Vec<_>, Vec<_>) =
                here.map(|((_, kind, _), run)| (*kind, run)).partition(|(_, run)| run.trouble.is_none());
            progress.done += others.len();
            for run in time_pass(case, *dt_ms, timed, (options, longest_s)) {
                progress.line("time", run, &format!("{:.3} ms of CPU a second", 1e3 * run.cpu_s));
            }
        }
    }
    let mut peers: Vec<&str> =
        kinds.iter().filter(|kind| **kind != EngineKind::Own).map(|kind| kind.name()).collect();
    peers.dedup();
    let comparison = Comparison {
        format: FORMAT,
        quick: options.quick,
        machine,
        commit,
        repeats: options.repeats,
        run_limit_s: options.run_limit_s,
        engines,
        verdicts: verdicts(&runs, EngineKind::Own.name(), &peers),
        runs,
        ticks: ticks::measure(options.repeats)?,
        left_out,
        took_s: begin.elapsed().as_secs_f64(),
    };
    fs::create_dir_all(&options.out).with_context(|| format!("cannot create {}", options.out.display()))?;
    let json = serde_json::to_string_pretty(&comparison)? + "\n";
    fs::write(options.out.join("report.json"), json)?;
    plots::draw(&comparison, &options.out)?;
    fs::write(options.out.join("README.md"), page::write(&comparison))?;
    println!("{} in {:.0} s", options.out.join("README.md").display(), comparison.took_s);
    Ok(comparison)
}

/// What each engine is, and whether it can run.
fn notes(options: &Options) -> Vec<EngineNote> {
    let note = |kind: EngineKind| {
        let (version, settings) = match kind {
            EngineKind::Own => (Ok(env!("CARGO_PKG_VERSION").to_owned()), own_notes()),
            EngineKind::Rapier(_) => (Ok("0.36.1".to_owned()), rapier::notes()),
            EngineKind::MuJoCo(_) => (mujoco::version(), mujoco::notes()),
        };
        let chosen: Vec<&EngineKind> =
            options.engines.iter().filter(|other| other.name() == kind.name()).collect();
        let wanted = kind == EngineKind::Own || !chosen.is_empty();
        let (ran, version) = match version {
            _ if !wanted => (false, "not asked for".to_owned()),
            Ok(version) => (true, version),
            Err(error) => {
                println!("{} is left out: {error:#}", kind.name());
                (false, format!("left out: {error:#}"))
            }
        };
        let reference_ms = 1e3 * reference_s(kind, options.quick);
        let said = chosen.iter().map(|kind| format!("`{}`: {}", kind.settings(), kind.about_settings()));
        let settings = settings.into_iter().chain(said).collect();
        EngineNote { name: kind.name().to_owned(), version, ran, reference_ms, settings }
    };
    let mut engines: Vec<EngineKind> = EngineKind::all().collect();
    engines.dedup_by_key(|kind| kind.name());
    engines.into_iter().map(note).collect()
}

fn own_notes() -> Vec<String> {
    vec![
        "the constants of `sim/src/config.rs`, the same at every step, and in every case but those named next".into(),
        "contact stiffness: in mass_ratio in proportion to the load, in sphere_stack, incline_sphere, bowling, \
         gripper_analytic, rolling_box_balls, heavy_on_grams and six_cubed 1e9 N/m (their bodies are rigid), in spring_cylinder the published one"
            .into(),
    ]
}

fn choose(options: &Options) -> Result<(Vec<&'static Case>, Vec<String>)> {
    let all: Vec<&Case> = cases::all().collect();
    if !options.cases.is_empty() {
        let find = |name: &String| {
            all.iter().find(|case| case.name == name).copied().with_context(|| {
                let names: Vec<&str> = all.iter().map(|case| case.name).collect();
                format!("unknown case `{name}`; known cases: {}", names.join(", "))
            })
        };
        return Ok((options.cases.iter().map(find).collect::<Result<_>>()?, Vec::new()));
    }
    if options.quick {
        let chosen = all.into_iter().filter(|case| QUICK_CASES.contains(&case.name)).collect();
        return Ok((chosen, vec!["all others: this is a quick report".into()]));
    }
    let out = all.iter().filter_map(|case| Some(format!("`{}`: {}", case.name, left_out(case.name)?)));
    let out = out.collect();
    Ok((all.into_iter().filter(|case| left_out(case.name).is_none()).collect(), out))
}

/// One run for its error, with a reference run where it needs one.
fn error_pass(case: &Case, kind: EngineKind, dt_ms: f64, quick: bool) -> Run {
    let reference_dt_s = Some(reference_s(kind, quick));
    let setup = Setup { reference_dt_s, ..Setup::new(kind, 1e-3 * dt_ms) };
    let mut run = Run {
        case: case.name.to_owned(),
        engine: kind.name().to_owned(),
        settings: kind.settings().to_owned(),
        dt_ms,
        error: None,
        invariants: Invariants::default(),
        trouble: None,
        unfinished: false,
        cpu_s: 0.0,
        cpu_s_between: [0.0; 2],
        us_per_step: Default::default(),
    };
    match cases::run(case.name, &setup) {
        Ok((Report { error, invariants, .. }, _)) => {
            run.trouble = trouble(&error, &invariants);
            (run.error, run.invariants) = (Some(Figure { value: finite(error.value), ..error }), invariants);
        }
        Err(error) => {
            run.unfinished = error.downcast_ref::<NotFinished>().is_some();
            run.trouble = Some(format!("{error:#}").lines().next().unwrap_or("failed").to_owned());
        }
    }
    run
}

/// JSON knows no infinities.
fn finite(value: Option<f64>) -> Option<f64> {
    value.filter(|x| x.is_finite())
}

/// Runs for the clock alone, after the error pass has warmed everything up. The engines take turns: where the machine is
/// slower for a while, it is so for all.
fn time_pass<'a>(
    case: &Case,
    dt_ms: f64,
    runs: Vec<(EngineKind, &'a mut Run)>,
    (options, longest_s): (&Options, f64),
) -> Vec<&'a mut Run> {
    let within =
        |run: &mut dyn FnMut() -> Option<Times>| limit::within(options.run_limit_s.min(TIMED_S), run);
    let mut clocks = Vec::new();
    for (kind, run) in runs {
        let setup = Setup::new(kind, 1e-3 * dt_ms);
        let mut play = move || {
            let mut recorder = Recorder::for_at_most(longest_s);
            let finished = (case.run)(&setup, &mut recorder).is_ok();
            (finished || recorder.broke_off() || limit::used_up()).then(|| recorder.times())
        };
        let clock: Box<dyn FnMut() -> Option<Times>> = if matches!(kind, EngineKind::MuJoCo(_)) {
            let (first, mut recording) = mujoco::Recording::of(|| within(&mut play));
            Box::new(move || Some(Times { total: 1e6 * recording.replay(longest_s).ok()?, ..first? }))
        } else {
            Box::new(move || within(&mut play))
        };
        clocks.push((run, clock, Vec::new()));
    }
    for _ in 0..options.repeats {
        for (_, clock, times) in &mut clocks {
            times.extend(clock());
        }
    }
    let finish = |(run, _, mut times): (&'a mut Run, _, Vec<Times>)| {
        if times.is_empty() {
            run.trouble = Some("did not run a second time".into());
            return run;
        }
        times.sort_by(|a, b| a.total.total_cmp(&b.total));
        // µs a step are ms of CPU a simulated second at 1 ms.
        let cpu = |total_us: f64| total_us * 1e-3 / dt_ms;
        run.us_per_step = times[times.len() / 2];
        run.cpu_s = cpu(run.us_per_step.total);
        run.cpu_s_between = [cpu(times[0].total), cpu(times[times.len() - 1].total)];
        run
    };
    clocks.into_iter().map(finish).collect()
}

fn said(run: &Run) -> String {
    let figure = run.error.as_ref().and_then(|figure| Some((figure.value?, &figure.unit)));
    let error = figure.map_or_else(String::new, |(value, unit)| format!("{value:.2e} {unit}"));
    match &run.trouble {
        Some(trouble) => format!("{error} ({trouble})"),
        None => error,
    }
}

struct Progress {
    begin: Instant,
    done: usize,
    all: usize,
}

impl Progress {
    fn line(&mut self, pass: &str, run: &Run, said: &str) {
        self.done += 1;
        let spent = self.begin.elapsed().as_secs_f64();
        let left = spent / self.done as f64 * (self.all - self.done) as f64;
        println!(
            "[{:>4}/{}] {spent:>5.0} s, about {left:.0} s left | {pass:<5} {} {} {} ms: {said}",
            self.done, self.all, run.case, run.engine, run.dt_ms
        );
        let _ = std::io::stdout().flush();
    }
}

/// Reads a report back and says of every case whether a peer is ahead of ours.
///
/// # Errors
/// No such file, or not a report of this format, or a peer is ahead somewhere.
pub fn check(path: &std::path::Path) -> Result<()> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let comparison: Comparison =
        serde_json::from_str(&text).with_context(|| format!("{} is no report", path.display()))?;
    ensure!(comparison.format == FORMAT, "format {} is not {FORMAT}", comparison.format);
    let mut ahead = 0;
    for verdict in &comparison.verdicts {
        println!("{:<26}{:<8}{}", verdict.case, verdict.peer, verdict.words());
        ahead += usize::from(!verdict.holds());
    }
    if ahead > 0 {
        bail!(
            "in {ahead} of {} comparisons a peer is ahead at an equal or smaller error",
            comparison.verdicts.len()
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder of this test's own, removed afterwards.
    struct Folder(PathBuf);

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_small_report_is_complete_and_can_be_read_back() {
        let folder = Folder(std::env::temp_dir().join(format!("palmares-report-{}", std::process::id())));
        let options = Options {
            out: folder.0.clone(),
            engines: vec![EngineKind::Own, EngineKind::Rapier(&rapier::STIFF120)],
            cases: vec!["bowling".into()],
            steps_ms: vec![2.0, 8.0],
            repeats: 1,
            quick: true,
            run_limit_s: 60.0,
        };
        let made = write(&options).expect("it runs");
        assert_eq!(made.runs.len(), 4);
        for run in &made.runs {
            assert_eq!(run.trouble, None, "{run:?}");
            assert!(run.cpu_s > 0.0 && run.usable_error().is_some(), "{run:?}");
        }
        assert_eq!(made.verdicts.len(), 1);
        assert_eq!((made.verdicts[0].usable, made.verdicts[0].tried), (2, 2));
        assert!(made.ticks.iter().all(|way| way.lifted), "the pan is lifted both ways");
        for file in ["README.md", "report.json", "bowling.svg", "stable.svg", "split.svg", "ticks.svg"] {
            let text = fs::read_to_string(folder.0.join(file)).expect("the report wrote it");
            assert!(text.contains("bowling") || file == "ticks.svg", "{file}");
        }
        let text = fs::read_to_string(folder.0.join("report.json")).expect("written");
        let read: Comparison = serde_json::from_str(&text).expect("it can be read");
        assert_eq!(read.verdicts, made.verdicts);
        assert_eq!(check(&folder.0.join("report.json")).is_ok(), made.verdicts[0].holds());
    }

    #[test]
    fn unknown_cases_are_refused_with_the_known_ones() {
        let options = Options {
            out: PathBuf::new(),
            engines: Vec::new(),
            cases: vec!["bowlin".into()],
            steps_ms: Vec::new(),
            repeats: 1,
            quick: true,
            run_limit_s: 60.0,
        };
        let message = write(&options).expect_err("refused").to_string();
        assert!(message.contains("bowling"), "{message}");
    }
}
