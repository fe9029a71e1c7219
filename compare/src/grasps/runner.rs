//! Plays many grasps on several threads, keeps the finished ones in a file, and continues from there.

use crate::child;
use crate::engine::{EngineKind, mujoco};
use crate::scene_id;
use crate::trials::family::{Family, HandKind, Trial};
use crate::trials::play::Fate;
use anyhow::{Context, Result};
use palmares_bench::machine;
use palmares_bench::run_log::{RunLog, is_of_commit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Interval of the progress messages.
const REPORTED_EVERY: Duration = Duration::from_secs(10);

/// One grasp in one engine at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Hand, family and the grasp's place in it.
    pub hand: String,
    /// The family.
    pub family: String,
    /// The grasp.
    pub index: usize,
    /// Engine and settings.
    pub engine: String,
    /// Name of its settings.
    pub settings: String,
    /// ms
    pub step_ms: f64,
    /// Shift of the object from its drawn place, µm.
    #[serde(default)]
    pub aside_um: f64,
    /// Identity of its scene and set point.
    #[serde(default)]
    pub scene: String,
    /// The outcome.
    pub fate: Fate,
    /// Wall-clock time of the run, s: for the estimate of the time left.
    pub wall_s: f64,
}

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
    /// Engines; peers only with the SoftHand, as they have no tendons whose R depends on q.
    pub engines: Vec<EngineKind>,
    /// Steps, ms.
    pub steps_ms: Vec<f64>,
    /// Grasps of each family.
    pub placements: usize,
    /// Shift of objects from their drawn places, µm.
    pub aside_um: f64,
    /// Threads.
    pub jobs: usize,
    /// CPU time of a peer's run, s; beyond it the run is not finished.
    pub run_limit_s: f64,
    /// Whether the file's runs of peers count from any commit.
    pub reuse_peers: bool,
    /// Whether nothing is played: only the runs in the file are counted.
    pub count_only: bool,
}

struct Task<'a> {
    trial: &'a Trial,
    /// [Identity](scene_id) of the trial.
    scene: &'a str,
    engine: EngineKind,
    step_ms: f64,
    aside_um: f64,
}

/// Hand, family, engine, settings, step in ns, µm aside in bits, index.
type Key = (String, String, String, String, u64, u64, usize);

impl Run {
    fn key(&self) -> Key {
        let step = (self.step_ms * 1e6).round() as u64;
        let text = [&self.hand, &self.family, &self.engine, &self.settings].map(Clone::clone);
        let [hand, family, engine, settings] = text;
        (hand, family, engine, settings, step, self.aside_um.to_bits(), self.index)
    }
}

impl Task<'_> {
    fn key(&self) -> Key {
        let step = (self.step_ms * 1e6).round() as u64;
        let text =
            [self.trial.hand.name(), self.trial.family.name(), self.engine.name(), self.engine.settings()]
                .map(str::to_owned);
        let [hand, family, engine, settings] = text;
        (hand, family, engine, settings, step, self.aside_um.to_bits(), self.trial.index)
    }

    fn play(&self, run_limit_s: f64) -> Result<Run> {
        let begin = Instant::now();
        let (hand, family, engine, settings, .., index) = self.key();
        let Task { step_ms, aside_um, .. } = *self;
        let task = child::Task::Grasp { hand: hand.clone(), family: family.clone(), index, aside_um };
        let fate = match task.play(self.engine, 1e-3 * step_ms, run_limit_s)? {
            Err(failure) if failure.unfinished => Fate::unknown(),
            fate => fate.with_context(|| format!("{:?}", self.key()))?,
        };
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
            fate,
            wall_s,
        })
    }
}

/// Plays the runs that the file lacks, adds them there, and returns all runs of the plan in its order.
///
/// # Errors
/// An engine is missing or fails, or the file cannot be written.
pub fn run(plan: &Plan, file: &Path) -> Result<Vec<Run>> {
    let mujoco = plan.engines.iter().any(|engine| matches!(engine, EngineKind::MuJoCo(_)));
    if mujoco && !plan.count_only {
        mujoco::version()?;
    }
    let trials = trials(plan)?;
    let tasks: Vec<Task> = trials
        .iter()
        .flat_map(|(trial, scene)| {
            let fits = |engine: &&EngineKind| trial.hand == HandKind::SoftHand || **engine == EngineKind::Own;
            plan.engines.iter().filter(fits).flat_map(move |engine| {
                let aside_um = plan.aside_um;
                let at =
                    move |step_ms: &f64| Task { trial, scene, engine: *engine, step_ms: *step_ms, aside_um };
                plan.steps_ms.iter().map(at)
            })
        })
        .collect();
    let commit = machine::commit();
    let (log, lines) = RunLog::open::<Line>(file)?;
    let mut known = known(lines, &commit, plan.reuse_peers);
    let scenes: BTreeMap<Key, &str> = tasks.iter().map(|task| (task.key(), task.scene)).collect();
    known.retain(|key, run| scenes.get(key).is_some_and(|scene| *scene == run.scene));
    let open: Vec<&Task> = tasks.iter().filter(|task| !known.contains_key(&task.key())).collect();
    eprintln!("{} of {} grasps are to be played", open.len(), tasks.len());
    if !plan.count_only {
        play_all(plan, &open, |run| {
            log.add(&Line { commit: commit.clone(), run: run.clone() })?;
            known.insert(run.key(), run);
            Ok(())
        })?;
    }
    Ok(tasks.iter().filter_map(|task| known.get(&task.key()).cloned()).collect())
}

/// The drawn grasps with their identities.
fn trials(plan: &Plan) -> Result<Vec<(Trial, String)>> {
    let mut trials = Vec::new();
    for hand in &plan.hands {
        for family in plan.families.iter().filter(|family| family.fits(*hand)) {
            for trial in Trial::of(*hand, *family, plan.placements)? {
                let scene = scene_id::of_trial(&trial)?;
                trials.push((trial, scene));
            }
        }
    }
    Ok(trials)
}

/// Runs of this commit; those of peers of any, if they are reused.
fn known(lines: Vec<Line>, commit: &str, reuse_peers: bool) -> BTreeMap<Key, Run> {
    let valid = |Line { commit: of, run }: &Line| {
        is_of_commit(of, commit) || reuse_peers && run.engine != EngineKind::Own.name()
    };
    lines.into_iter().filter(valid).map(|line| (line.run.key(), line.run)).collect()
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
            placements: 2,
            aside_um: 0.0,
            jobs,
            run_limit_s: 60.0,
            reuse_peers: false,
            count_only: false,
        }
    }

    #[test]
    fn runs_are_the_same_on_one_thread_and_on_three_and_a_cut_line_is_left_out() {
        let file = std::env::temp_dir().join(format!("palmares-grasps-{}.jsonl", std::process::id()));
        let play = |jobs: usize| {
            let mut runs = run(&plan(jobs), &file).expect("ours plays");
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
        assert!(one.iter().map(|run| run.key()).is_sorted_by(|a, b| a.6 <= b.6));
    }

    #[test]
    fn runs_of_a_commit_are_known_and_those_of_changed_files_are_not() {
        let trial = &Trial::of(HandKind::SoftHand, Family::Ball, 1).expect("drawn")[0];
        let run = Task { trial, scene: "a", engine: EngineKind::Own, step_ms: 16.0, aside_um: 0.0 }
            .play(60.0)
            .expect("ours plays");
        let peer = Run { engine: "mujoco".into(), ..run.clone() };
        let lines = || {
            let lines = [("aaaa", &run), ("bbbb+", &run), ("cccc", &peer)];
            lines.map(|(commit, run)| Line { commit: commit.to_owned(), run: run.clone() }).into()
        };
        let count = |commit, reuse| known(lines(), commit, reuse).len();
        assert_eq!(count("aaaa", false), 1);
        assert_eq!(count("bbbb+", false), 0);
        assert_eq!(count("dddd", false), 0);
        assert_eq!(count("dddd", true), 1);
    }
}
