//! `palmares-compare search`.

use super::climb::{Climb, Score};
use super::page;
use super::plays::{End, GRASPS, Play, Plays, SearchScene, Wanted};
use super::table::{Found, Set, Table};
use crate::engine::{EngineKind, mujoco, rapier};
use anyhow::{Context, Result, ensure};
use clap::Args;
use palmares_bench::record::Record;
use parking_lot::Mutex;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Scenes, extent and output of a search.
#[derive(Args, Clone, Debug)]
pub struct SearchOptions {
    /// Engines, by commas.
    #[arg(long, value_delimiter = ',', default_value = "mujoco,rapier")]
    engines: Vec<String>,
    /// Cases, by commas; `grasps` are drawn grasps of the SoftHand.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "softhand_cylinder,softhand_box,softhand_balls,thirty_objects_and_hand,grasps"
    )]
    cases: Vec<String>,
    /// Steps, ms, by commas.
    #[arg(long, value_delimiter = ',', default_value = "1,2")]
    steps_ms: Vec<f64>,
    /// Starts of each case.
    #[arg(long, default_value_t = 2)]
    starts: u32,
    /// Drawn grasps of each family.
    #[arg(long, default_value_t = 4)]
    grasps: usize,
    /// Number of sets whose single changes are tried, for each engine and scene.
    #[arg(long, default_value_t = 4)]
    expansions: usize,
    /// CPU time of a play, s; beyond it, it is not finished.
    #[arg(long, default_value_t = 30.0)]
    run_limit_s: f64,
    /// Number of plays at once.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Time after which no new set is tried in a scene of an engine, minutes.
    #[arg(long)]
    minutes: Option<f64>,
    /// File of single plays, from which a stopped search goes on.
    #[arg(long, default_value = "target/search.jsonl")]
    runs: PathBuf,
    /// Folder of the page and its JSON.
    #[arg(long, default_value = "docs/report/search")]
    out: PathBuf,
}

/// Searches and writes the page.
///
/// # Errors
/// Unknown names, an engine that is missing, or a file that cannot be written.
pub fn run(options: &SearchOptions) -> Result<()> {
    ensure!(options.steps_ms.iter().all(|step| *step > 0.0 && *step <= 100.0), "a step is out of range");
    ensure!(options.starts > 0 && options.grasps > 0, "at least one start and one grasp are needed");
    let plays = Mutex::new(Plays::open(&options.runs)?);
    let mut found = Vec::new();
    for case in &options.cases {
        let scene = SearchScene::new(case, options.starts, options.grasps)?;
        for engine in &options.engines {
            let kind = EngineKind::from_names(engine, None)?;
            let version = match kind {
                EngineKind::MuJoCo(_) => mujoco::version()?,
                EngineKind::Rapier(_) => rapier::VERSION.to_owned(),
                EngineKind::Own => anyhow::bail!("ours has one set of settings: there is nothing to search"),
            };
            if let Some(why) = scene.refused.get(kind.name()) {
                println!("{case} {engine}: {why}");
                continue;
            }
            let search = Search { options, scene: &scene, version: &version, begin: Instant::now() };
            found.push(search.run(kind, &plays)?);
            publish(options, &found)?;
        }
    }
    Ok(())
}

/// Writes what is known so far; a search takes long.
fn publish(options: &SearchOptions, found: &[Found]) -> Result<()> {
    let table = Table::new(Record::now("search")?, options.steps_ms.clone(), found.to_vec());
    fs::create_dir_all(&options.out).with_context(|| format!("cannot create {}", options.out.display()))?;
    fs::write(options.out.join("search.json"), serde_json::to_string(&table)? + "\n")?;
    Ok(fs::write(options.out.join("README.md"), page::write(&table))?)
}

/// The search on one engine in one scene.
struct Search<'a> {
    options: &'a SearchOptions,
    scene: &'a SearchScene,
    version: &'a str,
    begin: Instant,
}

impl Search<'_> {
    fn run(&self, kind: EngineKind, plays: &Mutex<Plays>) -> Result<Found> {
        let mut climb = Climb::new(kind);
        self.try_all(&EngineKind::with_all_settings(kind.name())?, &mut climb, plays)?;
        for done in 0..self.options.expansions {
            let Some(next) = climb.next().filter(|_| !self.time_is_up()) else { break };
            let (best, score) = climb.ranked()[0];
            eprintln!(
                "{} {}: {} of {} rounds; `{best}` solves {} of {}; {} sets to try",
                self.scene.name,
                kind.name(),
                done,
                self.options.expansions,
                score.solved,
                score.of,
                next.len(),
            );
            self.try_all(&next, &mut climb, plays)?;
        }
        let set = |(settings, score): (&str, &Score)| Set {
            settings: settings.to_owned(),
            solved: score.solved,
            of: score.of,
            unfinished: score.unfinished,
        };
        Ok(Found {
            scene: self.scene.name.clone(),
            engine: kind.name().to_owned(),
            version: self.version.to_owned(),
            plays: self.scene.plays() * self.options.steps_ms.len(),
            sets: climb.ranked().into_iter().map(set).collect(),
        })
    }

    fn time_is_up(&self) -> bool {
        let minutes = self.begin.elapsed().as_secs_f64() / 60.0;
        self.options.minutes.is_some_and(|most| minutes > most)
    }

    /// Tries sets, several at once.
    fn try_all(&self, kinds: &[EngineKind], climb: &mut Climb, plays: &Mutex<Plays>) -> Result<()> {
        let (begin, all) = (Instant::now(), kinds.len());
        let shared = Mutex::new((climb, 0));
        let failed = Mutex::new(None);
        let next = AtomicUsize::new(0);
        let work = || {
            while let Some(kind) = kinds.get(next.fetch_add(1, Ordering::Relaxed)) {
                let (named, name) = (!kind.settings().contains('+'), kind.settings());
                if self.time_is_up() && !named {
                    return;
                }
                match self.try_one(*kind, plays) {
                    Ok(score) => {
                        let (climb, done) = &mut *shared.lock();
                        *done += 1;
                        let left_min =
                            begin.elapsed().as_secs_f64() / *done as f64 * (all - *done) as f64 / 60.0;
                        println!(
                            "{} {} `{name}`: {} of {}; {done} of {all} sets, {left_min:.1} min left",
                            self.scene.name,
                            kind.name(),
                            score.solved,
                            score.of
                        );
                        climb.known(name, score);
                    }
                    Err(error) => {
                        *failed.lock() = Some(error);
                        next.store(all, Ordering::Relaxed);
                    }
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.options.jobs.max(1) {
                scope.spawn(work);
            }
        });
        failed.into_inner().map_or(Ok(()), Err)
    }

    /// The plays of one set: the others only if one of the first solves the scene. The first are one start of a case, or
    /// a quarter of the grasps.
    fn try_one(&self, kind: EngineKind, plays: &Mutex<Plays>) -> Result<Score> {
        let all = self.scene.plays();
        let first = if self.scene.name == GRASPS { all.div_ceil(4) } else { 1 };
        let mut played: Vec<Play> = Vec::new();
        for number in 0..all {
            if number == first && played.iter().all(|play| play.end != End::Solved) {
                break;
            }
            for step_ms in &self.options.steps_ms {
                let limit_s = self.options.run_limit_s;
                let (scene, version, step_ms) = (self.scene, self.version, *step_ms);
                let wanted = Wanted { scene, number, kind, version, step_ms, limit_s };
                let known = plays.lock().get(&wanted);
                played.push(match known {
                    Some(play) => play,
                    None => {
                        let play = wanted.play()?;
                        plays.lock().add(&wanted, play.clone())?;
                        play
                    }
                });
            }
        }
        Ok(Score::of(&played))
    }
}
