//! `cargo xtask demo`: the whole system once, from an empty directory to a leaderboard.

use crate::cargo::build_server;
use crate::python::Environment;
use crate::server::Server;
use crate::viewer;
use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::{env, fs, process};

#[derive(Args)]
pub(crate) struct Options {
    /// Print the outcome as one JSON object on the last line.
    #[arg(long)]
    json: bool,
    /// Which task.
    #[arg(long, value_enum, default_value_t = Demonstrated::Balls)]
    task: Demonstrated,
    /// Which scene.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Keep the server's database and log, and say where they are.
    #[arg(long)]
    keep: bool,
}

/// The tasks that an example controller plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Demonstrated {
    Balls,
    Shelf,
    Grasp,
}

impl Demonstrated {
    fn example(self) -> &'static str {
        match self {
            Demonstrated::Balls => "src/palmares/examples/balls_softhand.py",
            Demonstrated::Shelf => "src/palmares/examples/shelf_softhand.py",
            Demonstrated::Grasp => "src/palmares/examples/grasp_softhand.py",
        }
    }

    /// Which field of the example's outcome says how many objects are where they should be, and what it counts.
    fn goal(self) -> (&'static str, &'static str) {
        match self {
            Demonstrated::Balls => ("balls_in_b", "balls in box B"),
            Demonstrated::Shelf => ("in_box", "objects in the box"),
            Demonstrated::Grasp => ("kept", "objects still in the hand after the shake"),
        }
    }
}

/// Builds, plays one run, prints what came of it.
pub(crate) fn run(options: &Options) -> Result<()> {
    eprintln!("== building the viewer");
    if let Err(error) = viewer::run() {
        eprintln!("the server is built without its viewer: {error:#}");
    }
    eprintln!("== building the server");
    let program = build_server(true)?;
    eprintln!("== preparing the Python environment");
    let environment = Environment::prepare()?;

    let directory = DataDirectory::create(options.keep)?;
    let server = Server::start(&program, &directory.path)?;
    eprintln!("== the example controller plays seed {} on {}", options.seed, server.url());
    let outcome = play(&environment, &server, options)?;
    let leaderboard = server.get_json("/v1/leaderboard")?;
    server.stop()?;
    let replay = keep_replay(&directory, &program, &outcome)?;

    if options.json {
        println!("{}", summary(options.task, &outcome, &leaderboard, &replay));
    } else {
        print_for_people(options.task, &outcome, &leaderboard, &replay);
    }
    Ok(())
}

/// Runs the example; its progress goes to standard error, its outcome is returned.
fn play(environment: &Environment, server: &Server, options: &Options) -> Result<Value> {
    let output = environment
        .python()
        .args([options.task.example(), "--json"])
        .args(["--url", &server.url()])
        .args(["--seed", &options.seed.to_string()])
        .stderr(Stdio::inherit())
        .output()
        .context("cannot start the example")?;
    ensure!(output.status.success(), "the example failed ({}); see the messages above", output.status);
    let said = String::from_utf8_lossy(&output.stdout);
    let last = said.lines().last().context("the example printed nothing")?;
    serde_json::from_str(last).with_context(|| format!("the example did not end with JSON: {last}"))
}

/// Takes the run's replay out of the data directory, which goes away, to a place beside the program.
fn keep_replay(directory: &DataDirectory, program: &Path, outcome: &Value) -> Result<PathBuf> {
    let run_id = outcome["run_id"].as_str().context("the example told no run")?;
    let target =
        program.parent().and_then(Path::parent).context("the program lies in no target directory")?;
    let folder = target.join("demo");
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let kept = folder.join(format!("{run_id}.mcap"));
    let recorded = directory.path.join("replays").join(format!("{run_id}.mcap"));
    fs::copy(&recorded, &kept).with_context(|| format!("no replay at {}", recorded.display()))?;
    Ok(kept)
}

fn summary(task: Demonstrated, outcome: &Value, leaderboard: &Value, replay: &Path) -> Value {
    let (field, _) = task.goal();
    json!({
        "score": outcome["score"],
        field: outcome[field],
        "run_id": outcome["run_id"],
        "leaderboard": leaderboard["rows"],
        "rtf": outcome["rtf"],
        "replay": replay.display().to_string(),
    })
}

fn print_for_people(task: Demonstrated, outcome: &Value, leaderboard: &Value, replay: &Path) {
    let run_id = outcome["run_id"].as_str().unwrap_or("?");
    let (field, counted) = task.goal();
    println!("score {}: {} {counted}, run {run_id}", outcome["score"], outcome[field]);
    println!(
        "{:.1} s simulated, {:.1} times as fast as real time",
        outcome["sim_time_s"].as_f64().unwrap_or_default(),
        outcome["rtf"].as_f64().unwrap_or_default()
    );
    println!("replay: {} (Foxglove shows it, `palmares verify` plays it again)", replay.display());
    println!("leaderboard:");
    for row in leaderboard["rows"].as_array().into_iter().flatten() {
        let team = row["team"].as_str().unwrap_or("?");
        println!("  {}. {team}: {} points in {} run(s)", row["rank"], row["total"], row["runs"]);
    }
}

/// Where the demonstration's server keeps its files; removed afterwards unless they are to be kept.
struct DataDirectory {
    path: PathBuf,
    keep: bool,
}

impl DataDirectory {
    fn create(keep: bool) -> Result<Self> {
        let path = env::temp_dir().join(format!("palmares-demo-{}", process::id()));
        fs::create_dir_all(&path).with_context(|| format!("cannot create {}", path.display()))?;
        Ok(DataDirectory { path, keep })
    }
}

impl Drop for DataDirectory {
    fn drop(&mut self) {
        if self.keep {
            eprintln!("== the server's files: {}", self.path.display());
        } else {
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}
