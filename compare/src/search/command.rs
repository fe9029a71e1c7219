//! `palmares-compare search`.

use super::halving::Halving;
use super::kept::{Sets, ranked, sets_of};
use super::page;
use super::player::Engines;
use super::plays::SearchScene;
use super::table::{Found, Table};
use crate::engine::{EngineKind, Surfaces};
use anyhow::{Context, Result, ensure};
use clap::Args;
use palmares_bench::record::Record;
use parking_lot::Mutex;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
        default_value = "grasps,softhand_cylinder,softhand_box,softhand_balls,mass_ratio,thirty_objects_and_hand"
    )]
    cases: Vec<String>,
    /// Steps, ms, by commas.
    #[arg(long, value_delimiter = ',', default_value = "1,2")]
    steps_ms: Vec<f64>,
    /// Starts of each case.
    #[arg(long, default_value_t = 4)]
    starts: u32,
    /// Drawn grasps of each family.
    #[arg(long, default_value_t = 4)]
    grasps: usize,
    /// Number of sets whose single changes are tried, for each engine and scene.
    #[arg(long, default_value_t = 2)]
    expansions: usize,
    /// CPU time of a play, s; beyond it, it is not finished.
    #[arg(long, default_value_t = 30.0)]
    run_limit_s: f64,
    /// Number of plays at once.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Time of an engine in a scene, minutes.
    #[arg(long)]
    minutes: Option<f64>,
    /// Go on with the searches that the result has. Without it, an engine is searched in a scene if the result has neither, or of
    /// another version.
    #[arg(long)]
    go_on: bool,
    /// Folder of the page and its JSON.
    #[arg(long, default_value = "docs/report/search")]
    out: PathBuf,
}

/// Searches and writes the page.
///
/// # Errors
/// Unknown names, an engine that is missing, or a file that cannot be read or written.
pub fn run(options: &SearchOptions) -> Result<()> {
    ensure!(options.steps_ms.iter().all(|step| *step > 0.0 && *step <= 100.0), "a step is out of range");
    ensure!(options.starts > 0 && options.grasps > 0, "at least one start and one grasp are needed");
    let file = options.out.join("search.json");
    let all = Mutex::new(if file.exists() { Table::read(&file)?.found } else { Vec::new() });
    for case in &options.cases {
        let scene = SearchScene::new(case, options.starts, options.grasps)?;
        for engine in &options.engines {
            let kind = EngineKind::from_names(engine, None)?;
            ensure!(!kind.space().is_empty(), "{engine} has no options to search");
            let version = kind.version()?;
            let is_this = |found: &Found| found.scene == *case && found.engine == *engine;
            if let Some(why) = scene.refused.get(kind.name()) {
                println!("{case} {engine}: {why}");
                all.lock().retain(|found| !is_this(found));
                continue;
            }
            let valid = |found: &&Found| {
                is_this(found) && found.identity == scene.identity && found.version == version
            };
            let kept = all.lock().iter().find(valid).cloned();
            if kept.is_some() && !options.go_on {
                println!("{case} {engine}: kept");
                continue;
            }
            let known = kept.as_ref().map_or(Ok(Sets::new()), sets_of)?;
            let save = |sets: &Sets| {
                let found = Found {
                    scene: case.clone(),
                    engine: engine.clone(),
                    version: version.clone(),
                    identity: scene.identity.clone(),
                    plays: scene.plays(&options.steps_ms).len(),
                    sets: ranked(sets),
                };
                let mut all = all.lock();
                match all.iter_mut().find(|found| is_this(found)) {
                    Some(old) => *old = found,
                    None => all.push(found),
                }
                publish(options, &all)
            };
            search(options, &scene, kind, known, &save)?;
        }
    }
    Ok(())
}

/// The search on one engine in one scene.
fn search(
    options: &SearchOptions,
    scene: &SearchScene,
    kind: EngineKind,
    known: Sets,
    save: &(dyn Fn(&Sets) -> Result<()> + Sync),
) -> Result<()> {
    let minutes = |most: f64| Instant::now() + Duration::from_secs_f64(60.0 * most);
    let player = Engines {
        scene,
        plays: scene.plays(&options.steps_ms),
        limit_s: options.run_limit_s,
        jobs: options.jobs,
        until: options.minutes.map(minutes),
        sets: Mutex::new(known),
        save,
    };
    let mut halving = Halving::new(&player, &scene.name, player.plays.len());
    // Those that reports play in this scene go first.
    let all = EngineKind::with_all_settings(kind.name())?.into_iter();
    let (named, others): (Vec<EngineKind>, Vec<EngineKind>) =
        all.partition(|it| it.plays(&scene.name, true, Surfaces::default()));
    halving.run(&named, options.expansions, &others)?;
    save(&player.sets.lock())?;
    match halving.best() {
        Some((best, score)) => {
            let settings = best.settings();
            println!(
                "{} {}: `{settings}` solves {} of {}",
                scene.name,
                kind.name(),
                score.solved,
                player.plays.len()
            );
        }
        None => println!("{} {}: no set has played all plays", scene.name, kind.name()),
    }
    Ok(())
}

/// Writes the page of a table anew.
///
/// # Errors
/// No such file, or not a table of this format.
pub fn rewrite(file: &Path) -> Result<()> {
    Ok(fs::write(file.with_file_name("README.md"), page::write(&Table::read(file)?))?)
}

/// Writes what is known so far; a search takes long.
fn publish(options: &SearchOptions, found: &[Found]) -> Result<()> {
    let table = Table::new(Record::now("search")?, options.steps_ms.clone(), found.to_vec());
    fs::create_dir_all(&options.out).with_context(|| format!("cannot create {}", options.out.display()))?;
    let file = options.out.join("search.json");
    let part = file.with_extension("part");
    fs::write(&part, serde_json::to_string(&table)? + "\n")?;
    fs::rename(&part, &file)?;
    Ok(fs::write(options.out.join("README.md"), page::write(&table))?)
}
