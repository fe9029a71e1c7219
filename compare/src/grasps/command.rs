//! `palmares-compare grasps`.

use super::runner::{self, Plan};
use super::{page, table, trace};
use crate::engine::EngineKind;
use crate::trials::family::{Family, HandKind, Trial};
use anyhow::{Context, Result, ensure};
use clap::Args;
use palmares_bench::cases::Setup;
use palmares_bench::record::Record;
use std::fs;
use std::path::{Path, PathBuf};

/// Options of a plan of grasps.
#[derive(Args, Clone, Debug)]
pub struct GraspOptions {
    /// Hands, by commas: softhand, reflex. Peers play the SoftHand alone.
    #[arg(long, value_delimiter = ',', default_value = "softhand,reflex")]
    hand: Vec<String>,
    /// Families, by commas: cylinder, box, plate, ball, cup, catalogue, case_cylinder, case_box.
    #[arg(long, value_delimiter = ',', default_value = "cylinder,box,plate,ball,cup,catalogue")]
    family: Vec<String>,
    /// Engines, by commas: own, rapier, mujoco.
    #[arg(long, value_delimiter = ',', default_value = "own,rapier,mujoco")]
    engine: Vec<String>,
    /// Named settings of the peers, by commas; all that are for grasps if not given.
    #[arg(long, value_delimiter = ',')]
    settings: Vec<String>,
    /// Steps, ms, by commas.
    #[arg(long, value_delimiter = ',', default_value = "0.25,0.5,1,2,4")]
    steps_ms: Vec<f64>,
    /// Those of them at which peers play, ms, by commas.
    #[arg(long, value_delimiter = ',', default_value = "1,2,4")]
    peer_steps_ms: Vec<f64>,
    /// Number of grasps of each family, the first of the draw.
    #[arg(long, default_value_t = 24)]
    placements: usize,
    /// Shift of each object from its drawn place, along the fingers, µm: if a micrometre changes an outcome,
    /// no step could get it right.
    #[arg(long, default_value_t = 0.0)]
    aside_um: f64,
    /// Number of grasps that are played at once.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Folder of the page and its JSON.
    #[arg(long, default_value = "docs/report/grasps")]
    out: PathBuf,
    /// File of single runs, from which a stopped plan continues if the program is of the same commit.
    #[arg(long, default_value = "target/grasps.jsonl")]
    runs: PathBuf,
    /// Play all runs of peers, also those that the page's JSON has with their keys of today.
    #[arg(long)]
    peers_anew: bool,
    /// CPU time of a peer's run, s; beyond it the run is not finished and is not counted.
    #[arg(long, default_value_t = 120.0)]
    run_limit_s: f64,
    /// Play only this grasp of one hand and family, and print its course.
    #[arg(long)]
    one: Option<usize>,
    /// With `--one`: interval of the prints, ms.
    #[arg(long, default_value_t = 20.0)]
    every_ms: f64,
}

impl GraspOptions {
    fn plan(&self) -> Result<Plan> {
        for step in &self.steps_ms {
            ensure!(
                *step > 0.0 && *step <= 100.0,
                "step {step} ms is out of range; it must be positive and at most 100 ms"
            );
        }
        ensure!(self.aside_um.abs() <= 1e3, "--aside-um {} is out of range; at most 1000", self.aside_um);
        ensure!(self.every_ms > 0.0, "--every-ms {} must be positive", self.every_ms);
        Ok(Plan {
            hands: self.hand.iter().map(|name| HandKind::from_name(name)).collect::<Result<_>>()?,
            families: self.family.iter().map(|name| Family::from_name(name)).collect::<Result<_>>()?,
            engines: self.engines()?,
            steps_ms: self.steps_ms.clone(),
            peer_steps_ms: self.peer_steps_ms.clone(),
            placements: self.placements,
            aside_um: self.aside_um,
            jobs: self.jobs,
            run_limit_s: self.run_limit_s,
            peers_anew: self.peers_anew,
        })
    }

    /// Every engine with the named settings that it has.
    fn engines(&self) -> Result<Vec<EngineKind>> {
        let mut engines = Vec::new();
        for name in &self.engine {
            let all = EngineKind::with_all_settings(name)?;
            let known = all.iter().map(|kind| kind.settings()).collect::<Vec<_>>().join(", ");
            let wanted: Vec<EngineKind> = all
                .into_iter()
                .filter(|kind| {
                    let is_named = || self.settings.iter().any(|settings| settings == kind.settings());
                    *kind == EngineKind::Own
                        || if self.settings.is_empty() { kind.plays_grasps() } else { is_named() }
                })
                .collect();
            ensure!(
                !wanted.is_empty(),
                "{name} has none of the settings {:?}; known: {known}",
                self.settings
            );
            engines.extend(wanted);
        }
        Ok(engines)
    }
}

/// Plays the chosen grasps.
///
/// # Errors
/// Unknown names, an engine that is missing or fails, a file that cannot be written.
pub fn run(options: &GraspOptions) -> Result<()> {
    let plan = options.plan()?;
    if let Some(index) = options.one {
        return one(options, &plan, index);
    }
    let record = Record::now("grasps")?;
    let json = options.out.join("grasps.json");
    let earlier = json.exists().then(|| table::Table::read(&json)).transpose()?;
    let kept = earlier.as_ref().filter(|_| !options.peers_anew).map(table::Table::kept).unwrap_or_default();
    let outcomes = runner::run(&plan, &options.runs, &kept)?;
    let mut table = table::Table::of(record, &plan, &outcomes);
    if let Some(earlier) = &earlier {
        table.pair_with(earlier);
    }
    fs::create_dir_all(&options.out)?;
    fs::write(&json, serde_json::to_string(&table)? + "\n")?;
    let page = page::write(&table);
    fs::write(options.out.join("README.md"), &page)?;
    println!("{page}");
    Ok(())
}

/// Writes the page of a table anew.
///
/// # Errors
/// No such file, or not a table of this format.
pub fn rewrite(file: &Path) -> Result<()> {
    let page = page::write(&table::Table::read(file)?);
    Ok(fs::write(file.with_file_name("README.md"), page)?)
}

fn one(options: &GraspOptions, plan: &Plan, index: usize) -> Result<()> {
    let single = "--one plays one grasp: name one --hand, one --family, one step and one engine";
    let ([hand], [family], [step_ms], [engine]) =
        (&plan.hands[..], &plan.families[..], &plan.steps_ms[..], &plan.engines[..])
    else {
        anyhow::bail!("{single}, a peer with one of its --settings");
    };
    let trials = Trial::of(*hand, *family, index + 1)?;
    let trial = trials
        .get(index)
        .with_context(|| format!("family `{}` has {} grasps, from 0 on", family.name(), trials.len()))?;
    trace::trace(&Setup::new(engine.factory(), 1e-3 * step_ms), trial, options.every_ms)
}
