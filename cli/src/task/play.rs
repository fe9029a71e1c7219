//! `palmares task play`.

use super::load::{load_hand, load_task, scene_error};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use palmares_hand_tools::{Script, script};
use palmares_replay::{Header, Recorder, Signer};
use palmares_tasks::{Outcome, Reason, Run, Seed};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

/// Options of `palmares task play`.
#[derive(Debug, Args)]
pub(crate) struct PlayArgs {
    /// A folder with a task.toml, that file, or the name of a built-in task
    task: String,
    /// The hand, by name or path
    #[arg(long, value_name = "HAND", default_value = "softhand")]
    hand: String,
    /// Seed of the scene
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..1 << 53))]
    seed: u64,
    /// The script
    #[arg(long, value_enum, default_value_t = Script::Sweep)]
    script: Script,
    /// Write the run as a replay, signed by a new key; only with a built-in hand
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Plays the task and prints the result.
pub(super) fn play(args: &PlayArgs) -> anyhow::Result<ExitCode> {
    let (task, warnings) = load_task(&args.task)?;
    let hand = load_hand(&args.hand)?;
    if args.replay.is_some() && palmares_models::hand::Hand::builtin(&hand.name).is_none() {
        bail!("--replay works with built-in hands only; for your own hand, play on a server");
    }
    let run = Run::new(task.clone(), hand.clone(), Seed::from_u64(args.seed));
    let mut run = run.map_err(|error| anyhow!(scene_error(&error, &warnings)))?;
    let mut recording =
        args.replay.as_deref().map(|file| Recording::begin(args.seed, file, &run)).transpose()?;
    for action in script(args.script, &task, hand.motors.len()) {
        if run.over().is_some() || !run.healthy() {
            break;
        }
        run.step(&action)?;
        if let Some(recording) = &mut recording {
            recording.recorder.tick(&run);
        }
    }
    let reason = match run.healthy() {
        true => run.over().unwrap_or(Reason::Stopped),
        false => Reason::WorldFault,
    };
    let outcome = run.finish(reason);
    if let Some(recording) = recording {
        recording.end(&run, &outcome)?;
    }
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&outcome)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    for event in &outcome.events {
        let names = run.scene().bodies.iter();
        let object = event.object.and_then(|k| names.clone().nth(k)).map_or("", |body| body.name.as_str());
        writeln!(out, "{:8.2} s  {} {object}", event.tick as f64 * task.tick_s, event.kind)?;
    }
    let (score, seconds, state) = (outcome.score, outcome.sim_time_s, &outcome.state_hash);
    writeln!(
        out,
        "{} with {}, seed {}: {score} points in {seconds:.2} s, {}",
        task.name,
        hand.name,
        args.seed,
        outcome.reason.as_str()
    )?;
    writeln!(out, "task {}\nfinal state {state}", task.content_hash())?;
    Ok(ExitCode::SUCCESS)
}

/// A replay in progress.
struct Recording<'a> {
    recorder: Recorder,
    /// Temporary folder.
    folder: PathBuf,
    /// The final file.
    file: &'a Path,
}

impl<'a> Recording<'a> {
    fn begin(seed: u64, file: &'a Path, run: &Run) -> anyhow::Result<Self> {
        let started =
            SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64);
        let run_id = format!("local_{started:016x}");
        let header = Header {
            seed_number: Some(seed),
            ..Header::new(&run_id, "palmares-task", run.task(), run.hand(), run.seed(), started)
        };
        let folder = file.parent().unwrap_or(Path::new("")).join(".palmares-replay");
        let signer = Arc::new(Signer::random()?);
        let recorder = Recorder::create(&folder, header, run, &signer, None);
        let recorder = recorder.with_context(|| format!("cannot write {}", file.display()))?;
        Ok(Recording { recorder, folder, file })
    }

    fn end(self, run: &Run, outcome: &Outcome) -> anyhow::Result<()> {
        let Recording { recorder, folder, file } = self;
        let written =
            recorder.finish(run, outcome).with_context(|| format!("cannot write {}", file.display()))?;
        std::fs::rename(&written.path, file).with_context(|| format!("cannot write {}", file.display()))?;
        // Not empty while another replay is in progress.
        let _ = std::fs::remove_dir(&folder);
        Ok(())
    }
}
