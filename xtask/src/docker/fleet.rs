//! `cargo xtask docker --fleet`: a fleet from deploy/fleet/compose.yaml, whose head is followed line by line in a copy of the folder. A
//! run is played through the proxy, its host is killed, and the run goes on.

use super::engine::{Engine, output};
use super::header;
use super::images::{self, Source};
use crate::http::get;
use crate::python::Environment;
use crate::workspace;
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest time until the three hosts are ready, and until a run is verified.
const WITHIN: Duration = Duration::from_secs(90);
/// The name of the image in the commands.
const IMAGE: &str = "palmares";
const HOSTS: [&str; 3] = ["h1", "h2", "h3"];

/// Checks that passed, failed and were skipped.
#[derive(Default)]
struct Report {
    passed: u32,
    failed: Vec<String>,
    skipped: Vec<String>,
}

impl Report {
    /// Makes a check; false if it fails.
    fn check(&mut self, name: &str, made: Result<String>) -> bool {
        match made {
            Ok(said) => {
                println!("ok      {name}: {said}");
                self.passed += 1;
                true
            }
            Err(error) => {
                println!("FAILED  {name}: {error:#}");
                self.failed.push(name.to_owned());
                false
            }
        }
    }

    fn skip(&mut self, name: &str, reason: &str) {
        println!("skipped {name}: {reason}");
        self.skipped.push(name.to_owned());
    }
}

/// Runs every check of the fleet with each compose that is installed; an error if one fails.
pub(super) fn run(program: &Path, environment: &Environment) -> Result<()> {
    let began = Instant::now();
    let engine = Engine::find().map_err(anyhow::Error::msg)?;
    let made = |image: Result<Result<String, String>>| image?.map_err(anyhow::Error::msg);
    let images = Images {
        palmares: made(images::build(&engine, &Source::Program(program)))?,
        postgres: made(images::postgres(&engine))?,
        haproxy: made(images::haproxy(&engine))?,
        store: made(images::store(&engine))?,
    };
    println!("{} s for the images", began.elapsed().as_secs());
    let mut report = Report::default();
    if images.postgres.starts_with("palmares-test") {
        report.skip("Postgres 17", "no image registry is reached; Debian's version stands in");
    }
    for compose in [["docker", "compose"], ["docker-compose", ""]] {
        let words: Vec<&str> = compose.into_iter().filter(|word| !word.is_empty()).collect();
        let name = words.join(" ");
        if !Engine::has(&words) {
            report.skip(&name, "not installed");
            continue;
        }
        println!("\n== {name}");
        let fleet = Fleet::prepare(&words, &images)?;
        if let Err(error) = fleet.play(program, environment, &mut report) {
            println!("--- the containers' log\n{}", fleet.logs());
            report.check(&name, Err(error));
        }
        report.check("taken down", fleet.down());
    }
    println!(
        "fleet: {} passed, {} failed{}, {} skipped{}; {} s",
        report.passed,
        report.failed.len(),
        named(&report.failed),
        report.skipped.len(),
        named(&report.skipped),
        began.elapsed().as_secs()
    );
    ensure!(report.failed.is_empty(), "the fleet does not work as its file says");
    Ok(())
}

fn named(names: &[String]) -> String {
    if names.is_empty() { String::new() } else { format!(" ({})", names.join(", ")) }
}

struct Images {
    palmares: String,
    postgres: String,
    haproxy: String,
    store: String,
}

/// A copy of deploy/ whose compose project this is. Dropping it takes the project down and gives the name of the image back.
struct Fleet<'a> {
    folder: TempDir,
    images: &'a Images,
    port: u16,
    project: String,
    /// The image that had the name before.
    tagged_before: Option<String>,
}

impl<'a> Fleet<'a> {
    fn prepare(compose: &[&str], images: &'a Images) -> Result<Self> {
        let folder = tempfile::tempdir().context("cannot make a folder")?;
        let copied =
            Command::new("cp").arg("-r").arg(workspace::root().join("deploy")).arg(folder.path()).status();
        ensure!(copied.is_ok_and(|status| status.success()), "cannot copy deploy/");
        // The commands say `docker compose`. Without a terminal the older program needs an option.
        let bin = folder.path().join("bin");
        fs::create_dir(&bin)?;
        let found = output(Command::new("sh").args(["-c", "command -v docker"]))?;
        let shim = format!(
            "#!/bin/sh\nif [ \"$1\" = compose ]; then\n    shift\n    [ \"$1\" = exec ] && {{ shift; set -- exec -T \"$@\"; }}\n    \
             exec {} \"$@\"\nfi\nexec {found} \"$@\"\n",
            if compose.len() == 1 { compose[0].to_owned() } else { format!("{found} compose") }
        );
        fs::write(bin.join("docker"), shim)?;
        output(Command::new("chmod").arg("755").arg(bin.join("docker")))?;
        let free = TcpListener::bind("127.0.0.1:0").context("a free port")?;
        let port = free.local_addr()?.port();
        let inspect = ["image", "inspect", "--format", "{{.Id}}", IMAGE];
        let tagged_before = output(Command::new("docker").args(inspect)).ok();
        output(Command::new("docker").args(["tag", &images.palmares, IMAGE]))?;
        let project = format!("palmares-fleet-{}", std::process::id());
        Ok(Fleet { folder, images, port, project, tagged_before })
    }

    fn place(&self) -> PathBuf {
        self.folder.path().join("deploy/fleet")
    }

    /// A command in the copy's root, with the images and the port in its environment.
    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        let path = std::env::var("PATH").unwrap_or_default();
        let bin = self.folder.path().join("bin");
        command.current_dir(self.folder.path()).stdin(Stdio::null());
        command.env("PATH", format!("{}:{path}", bin.display()));
        command.env("COMPOSE_PROJECT_NAME", &self.project).env("PALMARES_PORT", self.port.to_string());
        command.env("POSTGRES_IMAGE", &self.images.postgres).env("S3_IMAGE", &self.images.store);
        command.env("HAPROXY_IMAGE", &self.images.haproxy).env_remove("PALMARES_IMAGE");
        command
    }

    fn compose(&self, words: &[&str]) -> Result<String> {
        output(self.command("docker").arg("compose").args(words).current_dir(self.place()))
    }

    fn url(&self) -> String {
        format!("https://localhost:{}", self.port)
    }

    fn play(&self, program: &Path, environment: &Environment, report: &mut Report) -> Result<()> {
        let token = self.follow(report)?;
        ensure!(token.starts_with("plm_"), "the last command prints no token: {token}");
        let waited = Instant::now();
        for host in HOSTS {
            until(|| self.compose(&["exec", host, "palmares", "health"]).map(drop))?;
        }
        let admin = |words: &[&str]| -> Result<String> {
            let mut command = self.command(&program.display().to_string());
            command.args(["admin", "--url", &self.url(), "--ca", "certificate.crt"]).args(words);
            output(command.env("PALMARES_TOKEN", &token).current_dir(self.place()))
        };
        until(|| admin(&["status"]).map(drop))?;
        report.check("three hosts are ready, through the proxy with TLS", Ok(seconds(waited)));

        let added: Value = serde_json::from_str(&admin(&["team", "add", "crabs"])?)?;
        let team = added["token"].as_str().context("no token of a team")?;
        admin(&["open", "--reason", "nine o'clock"])?;
        let mut python = environment.python();
        python.args(["-c", include_str!("fleet_play.py"), &self.url(), team]);
        python.env("SSL_CERT_FILE", self.place().join("certificate.crt"));
        let mut player = python.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().context("Python")?;
        let mut said = BufReader::new(player.stdout.take().context("no output")?).lines();
        let half = said.next().context("the player has ended")??;
        ensure!(half == "half", "the player said {half}");
        let (host, container) = self.playing()?;
        output(self.command("docker").args(["kill", &container]))?;
        let killed = Instant::now();
        writeln!(player.stdin.take().context("no input")?, "go on")?;
        let last = said.next().context("the player has ended")??;
        let played: Value = serde_json::from_str(&last)?;
        player.wait()?;
        ensure!(played["tick"] == 200 && played["status"] == "provisional", "the run: {played}");
        report.check("a run goes on after its host is killed", Ok(format!("{host}, {}", seconds(killed))));

        let run = played["run_id"].as_str().context("no run")?;
        until(|| {
            let shown: Value = serde_json::from_str(&admin(&["run", "show", run])?)?;
            ensure!(shown["status"] == "verified", "the run is {}", shown["status"]);
            Ok(())
        })?;
        let board: Value = serde_json::from_str(&admin(&["export", "leaderboard", "--format", "json"])?)?;
        ensure!(board.to_string().contains("crabs"), "no team on the leaderboard: {board}");
        report.check("the run is verified and on the leaderboard", Ok(run.to_owned()));
        Ok(())
    }

    /// Runs the commands of the file's head one after another in one shell; returns what the last one prints.
    fn follow(&self, report: &mut Report) -> Result<String> {
        let mut script = "set -e\n".to_owned();
        let commands = header::commands(&workspace::root().join("deploy/fleet/compose.yaml"))?;
        for command in &commands {
            if command.starts_with("docker build ") {
                report.skip(
                    command,
                    "the image has cargo's build of the program; `cargo xtask docker` compiles in it",
                );
                continue;
            }
            script += &format!("echo; {command}\n");
        }
        let began = Instant::now();
        let printed = output(self.command("bash").args(["-c", &script]))?;
        report.check(
            "the head of compose.yaml, as written",
            Ok(format!("{} commands, {}", commands.len(), seconds(began))),
        );
        Ok(printed.lines().last().unwrap_or_default().trim().to_owned())
    }

    /// The host that has the session, and its container.
    fn playing(&self) -> Result<(&'static str, String)> {
        for host in HOSTS {
            let container = self.compose(&["ps", "-q", host])?;
            let format = "{{range .NetworkSettings.Networks}}{{.IPAddress}}{{end}}";
            let address = output(self.command("docker").args(["inspect", "--format", format, &container]))?;
            let metrics = get(&format!("{address}:8080"), "/metrics")?;
            if metrics.lines().any(|line| line == "palmares_sessions_open 1") {
                return Ok((host, container));
            }
        }
        bail!("no host has the session")
    }

    fn logs(&self) -> String {
        self.compose(&["logs", "--no-color", "--tail", "60"]).unwrap_or_else(|error| error.to_string())
    }

    /// Takes the containers and volumes down.
    fn down(&self) -> Result<String> {
        let began = Instant::now();
        self.compose(&["down", "--volumes", "--timeout", "5"])?;
        Ok(seconds(began))
    }
}

impl Drop for Fleet<'_> {
    fn drop(&mut self) {
        if let Err(error) = self.down() {
            println!("the compose project {} could not be taken down: {error:#}", self.project);
        }
        let back = match &self.tagged_before {
            Some(image) => output(Command::new("docker").args(["tag", image, IMAGE])),
            None => output(Command::new("docker").args(["rmi", IMAGE])),
        };
        if let Err(error) = back {
            println!("the image {IMAGE} stays that of the test: {error:#}");
        }
    }
}

fn seconds(since: Instant) -> String {
    format!("{:.1} s", since.elapsed().as_secs_f64())
}

/// Repeats a check until it succeeds, or its last error once the time is over.
fn until(mut check: impl FnMut() -> Result<()>) -> Result<()> {
    let began = Instant::now();
    loop {
        match check() {
            Ok(()) => return Ok(()),
            Err(error) if began.elapsed() > WITHIN => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(500)),
        }
    }
}
