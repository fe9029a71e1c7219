//! Plays many grasps on several threads, keeps the finished ones in a file, and continues from there.

use super::cell::{Cell, letter};
use super::run::Run;
use crate::child::{self, Failure};
use crate::engine::EngineKind;
use crate::peer_key::PeerRun;
use crate::scene_id::{self, AskedTrial};
use crate::trials::family::{Family, HandKind, Trial};
use crate::trials::play::{Ending, Fate, rules};
use anyhow::{Context, Result, ensure};
use palmares_bench::machine;
use palmares_bench::run_log::{RunLog, is_of_commit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Number of kept grasps that are played again.
const SENTINELS: usize = 10;
/// Interval of the progress messages.
const REPORTED_EVERY: Duration = Duration::from_secs(10);

/// A line of the file of runs.
#[derive(Serialize, Deserialize)]
struct Line {
    commit: String,
    run: Run,
}

/// The grasps to play.
pub struct Plan {
    /// Hands.
    pub hands: Vec<HandKind>,
    /// Families, where they fit the hand.
    pub families: Vec<Family>,
    /// Engines; peers only with the SoftHand, as their adapters pass on no tendons whose R depends on q.
    pub engines: Vec<EngineKind>,
    /// Steps, ms.
    pub steps_ms: Vec<f64>,
    /// Those of them at which peers play, ms.
    pub peer_steps_ms: Vec<f64>,
    /// Grasps of each family.
    pub placements: usize,
    /// Shift of objects from their drawn places, µm.
    pub aside_um: f64,
    /// Threads.
    pub jobs: usize,
    /// CPU time of a peer's run, s; beyond it the run is not finished.
    pub run_limit_s: f64,
    /// Whether all runs of peers are played, also those that are kept.
    pub peers_anew: bool,
}

/// The outcomes of a plan: runs, and cells of peers that are kept.
pub struct Outcomes {
    /// The runs, in the plan's order.
    pub runs: Vec<Run>,
    /// The kept cells.
    pub kept: Vec<KeptCell>,
}

/// All grasps of a family in an engine at one step, kept from an earlier table.
pub struct KeptCell {
    /// Hand, family, engine and settings.
    pub of: [String; 4],
    /// The outcomes.
    pub cell: Cell,
}

struct Task<'a> {
    trial: &'a Trial,
    /// [Identity](scene_id) of the trial.
    scene: &'a str,
    engine: EngineKind,
    step_ms: f64,
    aside_um: f64,
    /// [Key](crate::peer_key) of a peer's run.
    peer_key: Option<String>,
}

/// Hand, family, engine and settings; step in ns, µm aside in bits, index.
type Place = ([String; 4], u64, u64, usize);

/// The place of a run in its plan.
fn place(run: &Run) -> Place {
    let text = [&run.hand, &run.family, &run.engine, &run.settings].map(Clone::clone);
    (text, ns(run.step_ms), run.aside_um.to_bits(), run.index)
}

fn ns(step_ms: f64) -> u64 {
    (step_ms * 1e6).round() as u64
}

impl Task<'_> {
    fn of(&self) -> [String; 4] {
        let Task { trial, engine, .. } = self;
        [trial.hand.name(), trial.family.name(), engine.name(), engine.settings()].map(str::to_owned)
    }

    fn place(&self) -> Place {
        (self.of(), ns(self.step_ms), self.aside_um.to_bits(), self.trial.index)
    }

    fn play(&self, run_limit_s: f64) -> Result<Run> {
        let begin = Instant::now();
        let [hand, family, engine, settings] = self.of();
        let Task { step_ms, aside_um, trial: Trial { index, .. }, .. } = *self;
        let index = *index;
        let task = child::Task::Grasp { hand: hand.clone(), family: family.clone(), index, aside_um };
        let played = task.play(self.engine, 1e-3 * step_ms, run_limit_s)?;
        let fate = fate(played).with_context(|| format!("{:?}", self.place()))?;
        let wall_s = begin.elapsed().as_secs_f64();
        Ok(Run {
            hand,
            family,
            index,
            engine,
            settings,
            step_ms,
            aside_um,
            scene: self.scene.to_owned(),
            key: self.peer_key.clone(),
            fate,
            wall_s,
        })
    }
}

/// The outcome of a grasp that was played, did not end in its time, or has what the engine's adapter does not pass on.
fn fate(played: Result<Fate, Failure>) -> Result<Fate, Failure> {
    played.or_else(|failure| match failure {
        Failure { unfinished: true, .. } => Ok(Fate::unseen(Ending::NotFinished)),
        Failure { not_played: true, .. } => Ok(Fate::unseen(Ending::NotPlayed)),
        failure => Err(failure),
    })
}

/// Plays the runs that neither the file nor the kept cells have, adds them to the file, and returns all outcomes of the plan.
///
/// # Errors
/// An engine is missing or fails, or the file cannot be written.
pub fn run(plan: &Plan, file: &Path, kept: &BTreeMap<String, Cell>) -> Result<Outcomes> {
    let trials = trials(plan)?;
    let tasks = tasks(plan, &trials)?;
    let mut cells: BTreeMap<([String; 4], u64), Vec<&Task>> = BTreeMap::new();
    for task in &tasks {
        cells.entry((task.of(), ns(task.step_ms))).or_default().push(task);
    }
    let mut kept_cells = BTreeMap::new();
    let mut kept_tasks = Vec::new();
    for (of, tasks) in cells {
        let keys: Option<Vec<String>> = tasks.iter().map(|task| task.peer_key.clone()).collect();
        if let Some(cell) = keys.and_then(|keys| kept.get(&scene_id::of_all(&keys))) {
            kept_cells.insert(of, cell.clone());
            kept_tasks.push((tasks, &*cell.endings));
        }
    }
    sentinels(&kept_tasks, plan.run_limit_s)?;
    let commit = machine::commit();
    let (log, lines) = RunLog::open::<Line>(file)?;
    let mut known = known(lines, &commit, plan.peers_anew);
    let wanted: BTreeMap<Place, &Task> = tasks.iter().map(|task| (task.place(), task)).collect();
    known.retain(|place, run| {
        wanted.get(place).is_some_and(|task| task.scene == run.scene && task.peer_key == run.key)
    });
    let is_kept = |task: &Task| kept_cells.contains_key(&(task.of(), ns(task.step_ms)));
    let tasks: Vec<&Task> = tasks.iter().filter(|task| !is_kept(task)).collect();
    let open: Vec<&Task> = tasks.iter().copied().filter(|task| !known.contains_key(&task.place())).collect();
    eprintln!("{} grasps are to be played, {} tables of peers are kept", open.len(), kept_cells.len());
    play_all(plan, &open, |run| {
        log.add(&Line { commit: commit.clone(), run: run.clone() })?;
        known.insert(place(&run), run);
        Ok(())
    })?;
    let kept = kept_cells.into_iter().map(|((of, _), cell)| KeptCell { of, cell }).collect();
    Ok(Outcomes { runs: tasks.iter().filter_map(|task| known.get(&task.place()).cloned()).collect(), kept })
}

/// Plays some of the kept grasps again: one of each of [`SENTINELS`] cells, another place of the draw in each.
///
/// # Errors
/// One ends otherwise.
fn sentinels(cells: &[(Vec<&Task>, &str)], run_limit_s: f64) -> Result<()> {
    let count = cells.len().min(SENTINELS);
    for k in 0..count {
        let (tasks, endings) = &cells[k * cells.len() / count];
        let place = k * tasks.len() / count;
        let (task, kept) = (tasks[place], endings.chars().nth(place));
        // What did not end in its time may do so today.
        if kept == Some(letter(Ending::NotFinished)) {
            continue;
        }
        let now = letter(task.play(run_limit_s)?.fate.ending);
        ensure!(
            kept == Some(now),
            "{:?} ends with `{now}`, and {kept:?} is kept: --peers-anew plays all grasps of peers again",
            task.place()
        );
    }
    Ok(())
}

/// All runs of a plan.
fn tasks<'a>(plan: &Plan, trials: &'a [(Trial, AskedTrial)]) -> Result<Vec<Task<'a>>> {
    let mut versions: BTreeMap<&str, String> = BTreeMap::new();
    let mut tasks = Vec::new();
    for (trial, asked) in trials {
        let fits = |engine: &&EngineKind| trial.hand == HandKind::SoftHand || **engine == EngineKind::Own;
        for engine in plan.engines.iter().copied().filter(|engine| fits(&engine)) {
            if !versions.contains_key(engine.name()) {
                versions.insert(engine.name(), engine.version()?);
            }
            let plays = |step: &&f64| engine == EngineKind::Own || plan.peer_steps_ms.contains(step);
            for step_ms in plan.steps_ms.iter().filter(plays) {
                let run = PeerRun {
                    kind: engine,
                    version: &versions[engine.name()],
                    scene: &asked.identity,
                    needs: &asked.needs,
                    step_ms: *step_ms,
                    reference_ms: 0.0,
                    judged_by: &rules(trial.hand),
                    starts: 1,
                    run_limit_s: plan.run_limit_s,
                    quick: false,
                };
                // A grasp that is moved aside is played for a question, not for the page.
                let peer_key = run.key().map(|key| format!("{key}{}", aside(plan.aside_um)));
                let Plan { aside_um, .. } = *plan;
                tasks.push(Task {
                    trial,
                    scene: &asked.identity,
                    engine,
                    step_ms: *step_ms,
                    aside_um,
                    peer_key,
                });
            }
        }
    }
    Ok(tasks)
}

fn aside(um: f64) -> String {
    if um == 0.0 { String::new() } else { format!("+{um}um") }
}

/// The drawn grasps, and what each asks of an engine.
fn trials(plan: &Plan) -> Result<Vec<(Trial, AskedTrial)>> {
    let mut trials = Vec::new();
    for hand in &plan.hands {
        for family in plan.families.iter().filter(|family| family.fits(*hand)) {
            for trial in Trial::of(*hand, *family, plan.placements)? {
                let asked = scene_id::asked_of_trial(&trial)?;
                trials.push((trial, asked));
            }
        }
    }
    Ok(trials)
}

/// Runs of this commit; those of peers of any, if they are not played anew.
fn known(lines: Vec<Line>, commit: &str, peers_anew: bool) -> BTreeMap<Place, Run> {
    let valid =
        |Line { commit: of, run }: &Line| is_of_commit(of, commit) || !peers_anew && run.key.is_some();
    lines.into_iter().filter(valid).map(|line| (place(&line.run), line.run)).collect()
}

fn play_all(plan: &Plan, open: &[&Task], mut done: impl FnMut(Run) -> Result<()>) -> Result<()> {
    let next = AtomicUsize::new(0);
    let (sender, results) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                while let Some(task) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if sender.send(task.play(plan.run_limit_s)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let mut progress = Progress::new(open);
        for run in results {
            let run = run.inspect_err(|_| next.store(open.len(), Ordering::Relaxed))?;
            progress.report(&run);
            done(run)?;
        }
        Ok(())
    })
}

/// Prints the number of finished grasps and the time left.
struct Progress {
    begin: Instant,
    reported: Instant,
    done: usize,
    all: usize,
    /// By engine and settings: steps per millisecond of simulated time that are left, that are done, and the
    /// time of the latter, s.
    left: BTreeMap<String, [f64; 3]>,
    jobs_s: f64,
}

impl Progress {
    fn new(open: &[&Task]) -> Self {
        let mut left: BTreeMap<String, [f64; 3]> = BTreeMap::new();
        for task in open {
            let name = format!("{} {}", task.engine.name(), task.engine.settings());
            left.entry(name).or_default()[0] += 1.0 / task.step_ms;
        }
        let now = Instant::now();
        Progress { begin: now, reported: now, done: 0, all: open.len(), left, jobs_s: 0.0 }
    }

    fn report(&mut self, run: &Run) {
        self.done += 1;
        self.jobs_s += run.wall_s;
        let weight = 1.0 / run.step_ms;
        if let Some([left, done, took]) = self.left.get_mut(&format!("{} {}", run.engine, run.settings)) {
            *left -= weight;
            *done += weight;
            *took += run.wall_s;
        }
        if self.reported.elapsed() < REPORTED_EVERY && self.done < self.all {
            return;
        }
        self.reported = Instant::now();
        let sum = |k: usize| self.left.values().map(|it| it[k]).sum::<f64>();
        let typical = sum(2) / sum(1);
        let rate = |[_, done, took]: [f64; 3]| if done > 0.0 { took / done } else { typical };
        let left_s: f64 = self.left.values().map(|it| it[0] * rate(*it)).sum();
        let (spent_s, at_once) = (self.begin.elapsed().as_secs_f64(), self.jobs_s);
        let left_min = left_s * spent_s / at_once / 60.0;
        eprintln!("{} of {}, {:.1} min, {left_min:.1} min left", self.done, self.all, spent_s / 60.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn plan(jobs: usize) -> Plan {
        Plan {
            hands: vec![HandKind::SoftHand],
            families: vec![Family::Ball],
            engines: vec![EngineKind::Own],
            steps_ms: vec![8.0, 16.0],
            peer_steps_ms: Vec::new(),
            placements: 2,
            aside_um: 0.0,
            jobs,
            run_limit_s: 60.0,
            peers_anew: false,
        }
    }

    #[test]
    fn runs_are_the_same_on_one_thread_and_on_three_and_a_cut_line_is_left_out() {
        let file = std::env::temp_dir().join(format!("palmares-grasps-{}.jsonl", std::process::id()));
        let play = |jobs: usize| {
            let mut runs = run(&plan(jobs), &file, &BTreeMap::new()).expect("ours plays").runs;
            runs.iter_mut().for_each(|run| run.wall_s = 0.0);
            let text = fs::read_to_string(&file).expect("written");
            fs::write(&file, format!("{text}{{\"commit\":")).expect("written");
            runs
        };
        let one = play(1);
        let many = play(3);
        fs::remove_file(&file).expect("written");
        assert_eq!(one, many);
        assert_eq!(one.len(), 4);
        assert!(one.iter().map(|run| run.index).is_sorted());
    }

    /// The first grasp of a draw, in ours.
    fn one_of_ours() -> Run {
        let trial = &Trial::of(HandKind::SoftHand, Family::Ball, 1).expect("drawn")[0];
        let engine = EngineKind::Own;
        let task = Task { trial, scene: "a", engine, step_ms: 16.0, aside_um: 0.0, peer_key: None };
        task.play(60.0).expect("ours plays")
    }

    #[test]
    fn runs_of_a_commit_are_known_and_those_of_changed_files_are_not() {
        let run = one_of_ours();
        let peer = Run { engine: "mujoco".into(), key: Some("abcd".into()), ..run.clone() };
        let lines = || {
            let lines = [("aaaa", &run), ("bbbb+", &run), ("cccc", &peer)];
            lines.map(|(commit, run)| Line { commit: commit.to_owned(), run: run.clone() }).into()
        };
        let count = |commit, anew| known(lines(), commit, anew).len();
        assert_eq!((count("aaaa", true), count("aaaa", false)), (1, 2));
        assert_eq!((count("bbbb+", true), count("cccc", true)), (0, 1));
        assert_eq!((count("dddd", true), count("dddd", false)), (0, 1));
    }

    #[test]
    fn peers_play_at_their_steps_and_each_of_their_runs_has_a_key() {
        let rapier = EngineKind::from_names("rapier", None).expect("it is known");
        let engines = vec![EngineKind::Own, rapier];
        let plan = Plan { engines, steps_ms: vec![8.0, 16.0], peer_steps_ms: vec![16.0], ..plan(1) };
        let trials = trials(&plan).expect("drawn");
        let tasks = tasks(&plan, &trials).expect("a plan");
        let of = |engine: &str| tasks.iter().filter(|task| task.engine.name() == engine).count();
        assert_eq!((of("own"), of("rapier")), (4, 2), "two grasps, ours at both steps");
        for task in &tasks {
            assert_eq!(task.peer_key.is_some(), task.engine.name() == "rapier");
        }
        let aside = super::tasks(&Plan { aside_um: 1.0, ..plan }, &trials).expect("a plan");
        assert!(aside.iter().zip(&tasks).all(|(a, b)| a.peer_key.is_none() || a.peer_key != b.peer_key));
    }

    #[test]
    fn a_grasp_that_an_adapter_does_not_pass_on_is_not_played_and_not_counted() {
        let run = one_of_ours();
        let failed =
            |unfinished, not_played| fate(Err(Failure { said: "so".into(), unfinished, not_played }));
        let unseen = Run { fate: failed(false, true).expect("no error"), ..run.clone() };
        let cell = Cell::of(16.0, vec![&unseen, &run]);
        assert_eq!((cell.count.of, cell.count.not_played), (1, 1));
        assert!(cell.endings.contains('x'), "{}", cell.endings);
        assert_eq!(failed(true, false).expect("no error").ending, Ending::NotFinished);
        assert!(failed(false, false).is_err(), "whatever else fails is an error");
    }

    #[test]
    fn a_kept_grasp_that_ends_otherwise_is_an_error() {
        let trials = trials(&plan(1)).expect("drawn");
        let tasks = tasks(&Plan { steps_ms: vec![16.0], ..plan(1) }, &trials).expect("a plan");
        let played: String =
            tasks.iter().map(|task| letter(task.play(60.0).expect("ours plays").fate.ending)).collect();
        let tasks: Vec<&Task> = tasks.iter().collect();
        sentinels(&[(tasks.clone(), &played)], 60.0).expect("the same");
        let other = sentinels(&[(tasks, "dd")], 60.0).expect_err("another ending").to_string();
        assert!(other.contains("--peers-anew"), "{other}");
    }
}
