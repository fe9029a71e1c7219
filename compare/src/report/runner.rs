//! Runs cases over engines, settings and steps, and writes the report.

use super::comparison::{Choice, Clock, Comparison, EngineNote, FORMAT, Run};
use super::dominance::peer_results;
use super::job::Job;
use super::judgement::judge;
use super::outcome_cache::{OutcomeCache, Peers};
use super::passes::{self, Conduct, Progress, reference_s};
use super::{page, plots, sentinels, ticks};
use crate::engine::{EngineKind, drake, mujoco, rapier};
use crate::peer_key::PeerRun;
use crate::played::rules;
use crate::scene_id::{self, Asked};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use palmares_bench::cases::{self, Case};
use palmares_bench::machine;
use palmares_bench::record::Record;
use parking_lot::Mutex;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Content and output of a report.
#[derive(Args, Clone, Debug)]
pub struct ComparisonOptions {
    /// Folder of the report.
    #[arg(long, default_value = "docs/report")]
    pub out: PathBuf,
    /// The part of the pages of record that it makes: `report`, `further` or `hand_scenes`.
    #[arg(long, default_value = "report")]
    pub part: String,
    /// Engines; ours is always among them.
    #[arg(skip)]
    pub engines: Vec<EngineKind>,
    /// Cases, by commas; all that belong into a report if not given.
    #[arg(long, value_delimiter = ',')]
    pub cases: Vec<String>,
    /// Steps, ms, by commas; 0.25 to 16 ms if not given.
    #[arg(long, value_delimiter = ',')]
    pub steps_ms: Vec<f64>,
    /// Timing runs, of which the median counts.
    #[arg(long, default_value_t = 5)]
    pub repeats: usize,
    /// Number of outcomes that are gathered at once; as many as the machine has threads if not given.
    #[arg(long)]
    pub jobs: Option<usize>,
    /// Few cases and steps, coarse references: under three minutes.
    #[arg(long)]
    pub quick: bool,
    /// CPU time of a peer's run, and of its reference, s; beyond it the run is listed as not finished.
    #[arg(long, default_value_t = 60.0)]
    pub run_limit_s: f64,
    /// File of outcomes, from which a stopped report continues if the program is of the same commit.
    #[arg(long, default_value = "target/report.jsonl")]
    pub runs: PathBuf,
    /// A report's JSON from which runs of peers are taken, with their times, if their keys are those of today; that of `--out`
    /// if not given.
    #[arg(long)]
    pub keep: Option<PathBuf>,
    /// Play all runs of peers, also those that are kept.
    #[arg(long)]
    pub peers_anew: bool,
    /// Keep the outcomes of peers and time their runs again.
    #[arg(long, conflicts_with = "peers_anew")]
    pub times_anew: bool,
}

/// The steps of a report, ms.
const STEPS_MS: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
const QUICK_STEPS_MS: [f64; 3] = [2.0, 4.0, 8.0];
const QUICK_CASES: [&str; 3] = ["softhand_free", "softhand_cylinder", "slide_stop"];

/// Reason why a case is in a report only if it is named.
fn left_out(name: &str) -> Option<&'static str> {
    match name {
        _ if name.starts_with("self_consistency") => Some("says again, at dt/64, what the other rows say"),
        _ if name.ends_with("_60s") => Some("a minute of holding, for the gates"),
        _ if name.starts_with("poured_") => Some("many minutes at short steps, for the gates"),
        "grasp_max_dt" => Some("searches the step itself"),
        _ => None,
    }
}

/// No run's limit is longer than this, s.
const LONGEST_LIMIT_S: f64 = 86400.0;

/// Gathers the outcomes into the file of [`ComparisonOptions::runs`] and times nothing, so that the machine may do
/// other work.
///
/// # Errors
/// As [`write`].
pub fn gather(options: &ComparisonOptions) -> Result<()> {
    let Planned { jobs, steps, .. } = plan(options)?;
    let progress = Progress { begin: Instant::now(), done: 0, all: jobs.len() * steps.len() };
    passes::outcomes(
        &jobs,
        options.conduct(&steps),
        options.known(&machine::commit())?,
        &Mutex::new(progress),
    )?;
    Ok(())
}

impl ComparisonOptions {
    fn conduct<'a>(&self, steps_ms: &'a [f64]) -> Conduct<'a> {
        let ComparisonOptions { repeats, jobs, quick, run_limit_s, .. } = *self;
        Conduct { steps_ms, repeats, jobs, quick, run_limit_s }
    }

    /// The outcomes that are known.
    fn known(&self, commit: &str) -> Result<OutcomeCache> {
        let peers = if self.peers_anew { Peers::Anew } else { Peers::Kept(self.kept()?) };
        OutcomeCache::open(&self.runs, commit, self.quick, peers)
    }

    /// The runs of peers that an earlier report has, by their keys.
    fn kept(&self) -> Result<BTreeMap<String, Run>> {
        let of_out = self.out.join("report.json");
        let Some(path) = self.keep.as_ref().or_else(|| of_out.exists().then_some(&of_out)) else {
            return Ok(BTreeMap::new());
        };
        let earlier = read(path)?;
        let known = earlier.runs.iter().filter_map(|run| {
            let mut run = Run { kept: Some(earlier.kept(run)), ..run.clone() };
            if self.times_anew {
                run.forget_times();
            }
            Some((run.key.clone()?, run))
        });
        Ok(known.collect())
    }
}

/// The plan of a report.
struct Planned {
    engines: Vec<EngineNote>,
    jobs: Vec<Job>,
    steps: Vec<f64>,
    left_out: Vec<String>,
}

fn plan(options: &ComparisonOptions) -> Result<Planned> {
    ensure!(options.repeats > 0, "at least one timing run is needed");
    ensure!(
        options.run_limit_s > 0.0 && options.run_limit_s <= LONGEST_LIMIT_S,
        "a limit of {} s is out of range; it must be positive and at most a day",
        options.run_limit_s
    );
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
    for case in chosen {
        let asked = scene_id::of_case(case);
        let of = kinds.iter().filter(|kind| **kind == EngineKind::Own || case.peers);
        let of = of.filter(|kind| kind.plays(case.name, asked.hand, asked.surfaces));
        jobs.extend(of.map(|kind| {
            let version =
                engines.iter().find(|note| note.name == kind.name()).map_or("", |note| &note.version);
            job(case, *kind, version, &asked, options.conduct(&steps))
        }));
    }
    Ok(Planned { engines, jobs, steps, left_out })
}

/// The runs of a case on an engine.
fn job(case: &'static Case, kind: EngineKind, version: &str, asked: &Asked, conduct: Conduct) -> Job {
    let judged_by = rules(asked.figure.as_ref());
    let key = |dt_ms: &f64| {
        let run = PeerRun {
            kind,
            version,
            scene: &asked.identity,
            needs: &asked.needs,
            step_ms: *dt_ms,
            reference_ms: 1e3 * reference_s(kind, conduct.quick),
            judged_by: &judged_by,
            starts: passes::starts(case.name, *dt_ms, conduct.quick),
            run_limit_s: conduct.run_limit_s,
            quick: conduct.quick,
        };
        run.key()
    };
    let keys = conduct.steps_ms.iter().filter_map(key).collect();
    Job { case, kind, scene: asked.identity.clone(), keys, simulated_s: asked.simulated_s }
}

/// Runs what is not kept and writes the report.
///
/// # Errors
/// An option is out of range, or a file cannot be written.
pub fn write(options: &ComparisonOptions) -> Result<Comparison> {
    let begin = Instant::now();
    let record = Record::now(&options.part)?;
    let Planned { engines, jobs, steps, left_out } = plan(options)?;
    println!("{}", record.line());
    let ComparisonOptions { repeats, quick, run_limit_s, .. } = *options;
    let conduct = options.conduct(&steps);
    let progress = Mutex::new(Progress { begin, done: 0, all: 2 * jobs.len() * steps.len() });
    let known = options.known(&record.commit)?;
    let of_peers: usize = jobs.iter().map(|job| job.keys.len()).sum();
    println!("{} of {of_peers} runs of peers are kept", known.kept(&jobs));
    let mut runs = passes::outcomes(&jobs, conduct, known, &progress)?;
    let sentinels = sentinels::calibrate(&jobs, &mut runs, conduct)?;
    passes::timings(&jobs, &mut runs, conduct, &progress);
    let mut runs = runs.concat();
    judge(&mut runs);
    let peers = peers(&engines);
    let results = peer_results(&runs, EngineKind::Own.name(), &peers);
    let comparison = Comparison {
        format: FORMAT,
        part: options.part.clone(),
        quick,
        record,
        repeats,
        run_limit_s,
        run_limit_by: Clock::Cpu,
        engines,
        results,
        runs,
        sentinels,
        // One page shows them.
        ticks: if options.part == "report" { ticks::measure(repeats)? } else { Vec::new() },
        left_out,
        took_s: begin.elapsed().as_secs_f64(),
    };
    fs::create_dir_all(&options.out).with_context(|| format!("cannot create {}", options.out.display()))?;
    publish(&comparison, &options.out)?;
    println!("{} in {:.0} s", options.out.join("README.md").display(), comparison.took_s);
    Ok(comparison)
}

/// Engines that ran, without ours.
pub(super) fn peers(engines: &[EngineNote]) -> Vec<String> {
    let ran = engines.iter().filter(|note| note.ran && note.name != EngineKind::Own.name());
    ran.map(|note| note.name.clone()).collect()
}

fn publish(comparison: &Comparison, folder: &Path) -> Result<()> {
    fs::write(
        folder.join("report.json"),
        without_nulls(serde_json::to_value(comparison)?).to_string() + "\n",
    )?;
    plots::draw(comparison, folder)?;
    fs::write(folder.join("README.md"), page::write(comparison))?;
    Ok(())
}

/// The same without fields that are null, as most invariants of most runs are: they read as none when they are absent.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(fields) => {
            let there = fields.into_iter().filter(|(_, value)| !value.is_null());
            there.map(|(name, value)| (name, without_nulls(value))).collect()
        }
        Value::Array(values) => values.into_iter().map(without_nulls).collect(),
        value => value,
    }
}

/// Reads a report's JSON.
///
/// # Errors
/// No such file, or not a report of this format.
pub fn read(path: &Path) -> Result<Comparison> {
    let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let comparison: Comparison = serde_json::from_str(&text)
        .with_context(|| format!("{} is no report of format {FORMAT}", path.display()))?;
    ensure!(comparison.format == FORMAT, "{}: format {} is not {FORMAT}", path.display(), comparison.format);
    Ok(comparison)
}

/// Judges the runs of a report's JSON again, and writes its page and pictures anew.
///
/// # Errors
/// No such file, or not a report of this format.
pub fn rewrite(path: &Path) -> Result<()> {
    let mut comparison = read(path)?;
    judge(&mut comparison.runs);
    let peers = peers(&comparison.engines);
    comparison.results = peer_results(&comparison.runs, EngineKind::Own.name(), &peers);
    publish(&comparison, path.parent().unwrap_or(Path::new(".")))
}

/// Says of every case of a report whether a peer is ahead of ours.
///
/// # Errors
/// No such file, or not a report of this format, or a peer is ahead somewhere.
pub fn check(path: &Path) -> Result<()> {
    let comparison = read(path)?;
    for result in &comparison.results {
        println!("{:<26}{:<8}{}", result.case, result.peer, result.words());
    }
    let (ahead, all) = (comparison.ahead().count(), comparison.results.len());
    if ahead > 0 {
        bail!("in {ahead} of {all} comparisons a peer is ahead at an equal or smaller error");
    }
    Ok(())
}

/// A note on each engine, and whether it can run.
fn notes(options: &ComparisonOptions) -> Vec<EngineNote> {
    let note = |kind: EngineKind| {
        let notes = match kind {
            EngineKind::Own => own_notes(),
            EngineKind::Rapier(_) => rapier::notes(),
            EngineKind::MuJoCo(_) => mujoco::notes(),
            EngineKind::Drake(_) => drake::notes(),
        };
        let chosen: Vec<&EngineKind> =
            options.engines.iter().filter(|other| other.name() == kind.name()).collect();
        let wanted = kind == EngineKind::Own || !chosen.is_empty();
        let (ran, version) = match wanted.then(|| kind.version()) {
            None => (false, "not asked for".to_owned()),
            Some(Ok(version)) => (true, version),
            Some(Err(error)) => {
                println!("{} is left out: {error:#}", kind.name());
                (false, format!("left out: {error:#}"))
            }
        };
        let reference_ms = 1e3 * reference_s(kind, options.quick);
        let choice = |kind: &&EngineKind| Choice {
            name: kind.settings().to_owned(),
            about: kind.about_settings().to_owned(),
        };
        let settings = chosen.iter().map(choice).collect();
        let name = kind.name().to_owned();
        EngineNote { name, version, ran, reference_ms, notes, settings }
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

fn choose(options: &ComparisonOptions) -> Result<(Vec<&'static Case>, Vec<String>)> {
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
    fn a_grasp_is_judged_by_many_starts_and_its_fine_run_separately() {
        let folder = Folder(std::env::temp_dir().join(format!("palmares-starts-{}", std::process::id())));
        let options = ComparisonOptions {
            part: "report".to_owned(),
            out: folder.0.clone(),
            engines: vec![EngineKind::Own],
            cases: vec!["softhand_cylinder".into()],
            steps_ms: vec![8.0],
            repeats: 1,
            jobs: None,
            quick: true,
            run_limit_s: 60.0,
            runs: folder.0.join("runs.jsonl"),
            keep: None,
            peers_anew: false,
            times_anew: false,
        };
        let made = write(&options).expect("it runs");
        let read = read(&folder.0.join("report.json")).expect("written");
        let whole = |comparison: &Comparison| serde_json::to_value(comparison).expect("JSON");
        assert_eq!(whole(&read), whole(&made), "nothing is lost without nulls");
        let run = &made.runs[0];
        let starts = run.starts.expect("it is among those");
        assert_eq!((starts.tried, starts.done, run.judged()), (4, 4, Some(0.0)), "{run:?}");
        assert!(starts.median_overlap_mm.is_some_and(|mm| mm > 0.0 && mm < 5.0), "{starts:?}");
        assert!(run.difference().is_some_and(|mm| mm > 0.0), "{run:?}");
        let bound = run.invariants.overlap_bound_mm.expect("shapes touch");
        assert!((bound - 7.0).abs() < 1e-9, "half of a finger of 14 mm, not {bound}");
    }

    #[test]
    fn unknown_cases_are_refused_with_the_known_ones() {
        let options = ComparisonOptions {
            part: "report".to_owned(),
            out: PathBuf::new(),
            engines: Vec::new(),
            cases: vec!["bowlin".into()],
            steps_ms: Vec::new(),
            repeats: 1,
            jobs: None,
            quick: true,
            run_limit_s: 60.0,
            runs: PathBuf::new(),
            keep: None,
            peers_anew: false,
            times_anew: false,
        };
        let message = write(&options).expect_err("refused").to_string();
        assert!(message.contains("bowling"), "{message}");
    }
}
