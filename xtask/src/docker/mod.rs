//! The container: built, started with compose, played on from outside, stopped and started again.
//!
//! `cargo xtask test` puts its own build of the server into the image. `cargo xtask docker` compiles it within the image, as
//! users do, which takes several minutes.

mod engine;
mod fleet;
mod header;
mod images;

use crate::cargo::build_server;
use crate::http::get;
use crate::python::Environment;
use crate::viewer;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use engine::{Engine, Project};
pub(crate) use images::MOTO;
use images::Source;
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Stdio};
use std::time::{Duration, Instant};

/// Longest time until the container is healthy.
const HEALTHY_WITHIN: Duration = Duration::from_secs(90);
/// The grace period of compose.yaml, and some time for the engine.
const STOPPED_WITHIN: Duration = Duration::from_secs(45);

#[derive(Args)]
pub(crate) struct DockerOptions {
    /// Put cargo's build of the program into the image instead of compiling within it.
    #[arg(long)]
    prebuilt: bool,
    /// Follow the head of deploy/fleet/compose.yaml instead, with cargo's build of the program: three hosts, a proxy with TLS, Postgres, an
    /// object store. The last line says what passed, failed and was skipped.
    #[arg(long)]
    fleet: bool,
    /// With --prebuilt or --fleet: take this program instead of building one.
    #[arg(long)]
    program: Option<PathBuf>,
}

/// `cargo xtask docker`. A missing engine is an error here.
pub(crate) fn run(options: &DockerOptions) -> Result<()> {
    let environment = Environment::prepare()?;
    let prebuilt = || match &options.program {
        // The commands run in other folders.
        Some(program) => program.canonicalize().with_context(|| format!("--program {}", program.display())),
        None => viewer::run().and_then(|()| build_server(false)),
    };
    if options.fleet {
        return fleet::run(&prebuilt()?, &environment);
    }
    let program = options.prebuilt.then(prebuilt).transpose()?;
    match check(program.as_deref(), &environment)? {
        Ok(()) => Ok(()),
        Err(reason) => bail!("{reason}"),
    }
}

/// Runs every check of the container, or returns the reason why this machine cannot.
pub(crate) fn check(program: Option<&Path>, environment: &Environment) -> Result<Result<(), String>> {
    let engine = match Engine::find() {
        Ok(engine) => engine,
        Err(reason) => return Ok(Err(reason)),
    };
    let source = match program {
        Some(program) => Source::Program(program),
        None => Source::Repository,
    };
    let image = match images::build(&engine, &source)? {
        Ok(image) => image,
        Err(reason) => return Ok(Err(reason)),
    };
    let practice = engine.project("compose.yaml", &[("PALMARES_IMAGE", &image)]);
    with_log(&practice, live(&practice, environment))?;
    drop(practice);
    let postgres = match images::postgres(&engine)? {
        Ok(postgres) => postgres,
        Err(reason) => return Ok(Err(reason)),
    };
    let official = engine.project(
        "compose.postgres.yaml",
        &[
            ("PALMARES_IMAGE", &image),
            ("POSTGRES_IMAGE", &postgres),
            ("POSTGRES_PASSWORD", "0f6bd0a3f2"),
            ("PALMARES_COMPETITION", "./deploy/competition.toml"),
        ],
    );
    with_log(&official, competition(&official)).map(Ok)
}

fn with_log(project: &Project<'_>, outcome: Result<()>) -> Result<()> {
    if outcome.is_err() {
        println!("--- the containers' log\n{}", project.logs());
    }
    outcome
}

/// An official server with Postgres refuses clients without a token and keeps its secret over a restart.
fn competition(project: &Project<'_>) -> Result<()> {
    let secret = || -> Result<String> {
        project.up()?;
        let address = project.address()?;
        healthy(project)?;
        let competition: Value = serde_json::from_str(&get(&address, "/v1/competition")?)?;
        ensure!(competition["mode"] == "official", "the competition is {competition}");
        ensure!(get(&address, "/v1/sessions").is_err(), "strangers see the sessions");
        let secret = competition["seed_secret_sha256"].as_str().context("no hash of the secret")?;
        Ok(secret.to_owned())
    };
    let before = secret()?;
    not_root(project)?;
    let token = project.exec(&["stat", "--format=%a %u", "/data/organizer.token"])?;
    ensure!(token == "600 10001", "the organizer's token is open to others: {token}");
    project.stop()?;
    ensure!(secret()? == before, "another secret after the restart");
    println!("an official server on Postgres: closed to strangers, the same after a restart");
    Ok(())
}

/// Plays, stops and starts again.
fn live(project: &Project<'_>, environment: &Environment) -> Result<()> {
    project.up()?;
    let address = project.address()?;
    healthy(project)?;
    println!("healthy at {address}");
    not_root(project)?;
    pages(&address)?;

    let mut player = Player::start(environment, &address, "stopped")?;
    ensure!(player.hear()? == "done", "the first run");
    player.finish()?;
    let mut busy = Player::start(environment, &address, "left-open")?;
    ensure!(busy.hear()? == "open", "the second run");
    println!("two runs played from outside, one of them is open");

    let start = Instant::now();
    project.stop()?;
    ensure!(start.elapsed() < STOPPED_WITHIN, "SIGTERM took {:?}", start.elapsed());
    let state = project.state()?;
    ensure!(state["ExitCode"] == 0, "the program did not end in order: {state}");
    println!("stopped in {:.1} s", start.elapsed().as_secs_f64());
    drop(busy);

    project.up()?;
    let address = project.address()?;
    healthy(project)?;
    let board: Value = serde_json::from_str(&get(&address, "/v1/leaderboard")?)?;
    let teams: Vec<&str> =
        board["rows"].as_array().into_iter().flatten().filter_map(|row| row["team"].as_str()).collect();
    ensure!(teams.len() == 2, "after the restart the leaderboard has {teams:?}: {board}");
    for row in board["rows"].as_array().into_iter().flatten() {
        let run = row["tasks"]["balls"]["run_id"].as_str().context("a run")?;
        let run: Value = serde_json::from_str(&get(&address, &format!("/v1/runs/{run}"))?)?;
        ensure!(run["status"] == "practice" && run["score"].is_number(), "not scored: {run}");
    }
    println!("started again: both runs are scored and on the leaderboard");
    Ok(())
}

fn healthy(project: &Project<'_>) -> Result<()> {
    let start = Instant::now();
    loop {
        let state = project.state()?;
        match state["Health"]["Status"].as_str() {
            Some("healthy") => return Ok(()),
            Some("starting") if start.elapsed() < HEALTHY_WITHIN => {}
            _ => bail!("not healthy after {:?}: {state}", start.elapsed()),
        }
        std::thread::sleep(Duration::from_millis(250));
    }
}

/// The program runs without privileges and can write nowhere but in its volume.
fn not_root(project: &Project<'_>) -> Result<()> {
    let status = project.exec(&["cat", "/proc/1/status"])?;
    let field = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default();
        line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    ensure!(field("Uid:").iter().all(|uid| uid == "10001"), "the user is {:?}", field("Uid:"));
    ensure!(field("CapEff:") == ["0000000000000000"], "capabilities: {:?}", field("CapEff:"));
    ensure!(field("NoNewPrivs:") == ["1"], "privileges can be gained");
    ensure!(project.exec(&["touch", "/data/probe"]).is_ok(), "/data cannot be written");
    ensure!(project.exec(&["touch", "/probe"]).is_err(), "the root file system can be written");
    project.exec(&["rm", "/data/probe"])?;
    println!("not root, no capabilities, nothing writable but /data");
    Ok(())
}

/// Every page comes with scripts and style sheets of the viewer, and they are served.
fn pages(address: &str) -> Result<()> {
    let pages = ["/", "/live", "/replay", "/drive", "/hands", "/wall", "/admin"];
    let mut files = BTreeSet::new();
    for page in pages {
        let html = get(address, page)?;
        let named: Vec<&str> = html.split('"').filter(|text| text.starts_with("/assets/")).collect();
        for ending in [".js", ".css"] {
            let there = named.iter().any(|file| file.ends_with(ending));
            ensure!(there, "{page} names no {ending} of the viewer: was the program built without it?");
        }
        files.extend(named.into_iter().map(str::to_owned));
    }
    for file in &files {
        ensure!(!get(address, file)?.is_empty(), "{file} is empty");
    }
    println!("{} pages are served, and the {} files of the viewer that they name", pages.len(), files.len());
    Ok(())
}

/// A Python client outside of the container.
struct Player {
    child: Child,
    stdout: BufReader<ChildStdout>,
}

impl Player {
    fn start(environment: &Environment, address: &str, team: &str) -> Result<Self> {
        let mut python = environment.python();
        python.args(["-c", include_str!("play.py"), &format!("http://{address}"), team]);
        let mut child =
            python.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().context("cannot start Python")?;
        let stdout = BufReader::new(child.stdout.take().context("no standard output")?);
        Ok(Player { child, stdout })
    }

    /// The next word that it prints.
    fn hear(&mut self) -> Result<String> {
        let mut line = String::new();
        self.stdout.read_line(&mut line)?;
        Ok(line.trim().to_owned())
    }

    fn finish(mut self) -> Result<()> {
        let mut rest = String::new();
        self.stdout.read_to_string(&mut rest)?;
        let status = self.child.wait()?;
        ensure!(status.success(), "the player ended with {status}: {rest}");
        Ok(())
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
