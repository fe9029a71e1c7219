//! `cargo xtask test`: every check, side by side, with a summary.

mod counts;
mod job;
mod verdicts;

use crate::apt;
use crate::cargo::{build_for_tests, cargo, executable, idle_cargo};
use crate::docker;
use crate::instructions;
use crate::python::Environment;
use crate::tools;
use crate::viewer::Viewer;
use crate::workspace;
use anyhow::{Context, Result};
use clap::Args;
use counts::{Counts, PASSED, SKIPPED, Step, Tally};
use job::Job;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::Instant;
use verdicts::{Files, Inputs, Verdicts};

#[derive(Args)]
pub(crate) struct TestOptions {
    /// Keep the verdict of each check whose programs and files are those of an earlier run, and run the others only.
    #[arg(long)]
    quick: bool,
    /// Make only the checks whose name in the summary contains this, as `models` or `Python`.
    #[arg(long)]
    only: Option<String>,
}

/// The Python of `cargo xtask fleet`, from `client-py`.
const FLEET: &str = "../xtask/fleet";

/// How many tests of a program run at once.
const TEST_THREADS: &str = "RUST_TEST_THREADS";

/// Runs everything, also after a failure, and returns whether all of it passed.
pub(crate) fn run(options: &TestOptions) -> Result<bool> {
    let mut viewer = None;
    let mut steps = vec![step("viewer", || {
        let made = Viewer::prepare()?;
        made.build()?;
        viewer = Some(made);
        Ok(PASSED)
    })];
    steps.extend([
        step("Rust formatting", || whole(cargo().args(["fmt", "--all", "--check"]))),
        step("Postgres for the tests", || {
            let missing = "Postgres is not installed (Debian's package `postgresql`), and could not be";
            or_skipped(apt::postgres().then_some(()).ok_or_else(|| missing.to_owned()))
        }),
    ]);
    // pip waits for the network while cargo computes.
    let environment = thread::spawn(Environment::prepare);
    let mut built = None;
    steps.push(step("build of tests, server and Python extension", || {
        built = Some(build_for_tests()?);
        Ok(PASSED)
    }));
    let mut python = None;
    steps.push(step("Python environment", || {
        python = Some(environment.join().ok().context("it panicked; see above")??);
        Ok(PASSED)
    }));
    let verdicts = Verdicts::read();
    let mut jobs = Vec::new();
    let mut server = None;
    if let Some(artifacts) = &built {
        let program = executable(artifacts, "palmares")?;
        jobs.extend(rust_tests(artifacts, &program)?);
        if let Some(viewer) = &viewer {
            jobs.push(pages(viewer, python.as_ref(), &program));
        }
        server = Some(program);
    }
    if let Some(viewer) = &viewer {
        let only = || Inputs { programs: Vec::new(), files: Files::Under(vec!["viewer".into()]) };
        jobs.push(Job::new(
            "viewer's types and lints",
            viewer.npm(&["run", "--silent", "check"]),
            Counts::Whole,
            only(),
            30.0,
        ));
        let mut tests = viewer.npm(&["test", "--silent"]);
        tests.env("NO_COLOR", "1");
        jobs.push(Job::new("viewer's tests", tests, Counts::Vitest, only(), 15.0));
    }
    if let Some(environment) = &python {
        jobs.extend(python_checks(environment, server.as_deref()));
    }
    // They need the processors while tests wait for a third of their time. cargo lets one command at a time into the target
    // directory: these are one after another.
    let mut idle = beside();
    if let Some(word) = &options.only {
        jobs.retain(|job| job.name.contains(word.as_str()));
        idle.retain(|job| job.name.contains(word.as_str()));
    }
    let idle = thread::scope(|scope| {
        let beside = scope.spawn(|| job::run(idle, 1, &verdicts, options.quick));
        steps.extend(job::run(jobs, 2, &verdicts, options.quick));
        beside.join().unwrap_or_default()
    });
    steps.extend(idle);
    if let (Some(program), Some(environment), None) = (&server, &python, &options.only) {
        steps.push(step("container", || or_skipped(docker::check(Some(program), environment)?)));
    }

    println!("\n== summary");
    for Step { name, took, tally } in &steps {
        let status = if tally.failed == 0 { "ok    " } else { "FAILED" };
        println!("{status} {:7.1} s  {name}: {tally}", took.as_secs_f64());
    }
    let total = steps.iter().fold(Tally::default(), |sum, step| sum.plus(step.tally));
    println!("{total}");
    Ok(total.failed == 0)
}

/// A job for each program of Rust tests.
fn rust_tests(artifacts: &[Value], server: &Path) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for message in artifacts.iter().filter(|message| message["profile"]["test"] == true) {
        let Some(program) = message["executable"].as_str().map(PathBuf::from) else { continue };
        let manifest = message["manifest_path"].as_str().context("cargo names no manifest")?;
        let folder = Path::new(manifest).parent().context("a manifest has a folder")?;
        let target = message["target"]["name"].as_str().context("cargo names no target")?;
        let package = folder.strip_prefix(workspace::root()).unwrap_or(folder).display();
        let mut command = Command::new(&program);
        // A test that finds no program or data prints so: the output of those that pass is read, too.
        command.arg("--show-output").current_dir(folder).env("CARGO_MANIFEST_DIR", folder);
        command.env("PALMARES_SERVER_BIN", server);
        if std::env::var_os(TEST_THREADS).is_none() {
            let cores = thread::available_parallelism().map_or(1, usize::from);
            command.env(TEST_THREADS, cores.to_string());
        }
        // Tests may start the programs of their package.
        let of_package = artifacts.iter().filter(|other| other["manifest_path"] == message["manifest_path"]);
        let started = of_package.filter(|other| other["profile"]["test"] == false);
        let mut programs: Vec<PathBuf> =
            started.filter_map(|other| other["executable"].as_str().map(PathBuf::from)).collect();
        programs.push(program);
        if Files::starts_server(folder)? {
            programs.push(server.to_owned());
        }
        let inputs = Inputs { programs, files: Files::of_crate(folder)? };
        let usual_s = if target == "system" { 400.0 } else { 60.0 };
        jobs.push(Job::new(&format!("{package}, {target}"), command, Counts::Rust, inputs, usual_s));
    }
    Ok(jobs)
}

fn pages(viewer: &Viewer, python: Option<&Environment>, server: &Path) -> Job {
    let mut pages = viewer.npm(&["run", "--silent", "pages"]);
    if let Some(environment) = python {
        pages.env("PALMARES_CLIENT_PYTHON", environment.interpreter());
    }
    pages.env("PALMARES_SERVER_BIN", server);
    let places = ["viewer", "client-py", "docs", "models", "tasks"].map(str::to_owned);
    Job {
        name: "pages in Chromium".into(),
        begin: Box::new(move || {
            let missing = "Chromium is not installed (Debian's package `chromium`), and could not be";
            Ok(apt::chromium().ok_or_else(|| missing.to_owned()).map(|chromium| {
                pages.env("PALMARES_CHROMIUM", chromium);
                pages
            }))
        }),
        counts: Counts::Playwright,
        inputs: Inputs { programs: vec![server.to_owned()], files: Files::Under(places.into()) },
        usual_s: 390.0,
    }
}

fn python_checks(environment: &Environment, server: Option<&Path>) -> Vec<Job> {
    let python = |arguments: &[&str]| {
        let mut command = environment.python();
        command.arg("-m").args(arguments);
        command
    };
    let mut imports = environment.tool("lint-imports");
    imports.args(["--no-cache", "--no-logo"]);
    let ruff = python(&["ruff", "check", "--config", "pyproject.toml", ".", FLEET]);
    let format = python(&["ruff", "format", "--check", "--config", "pyproject.toml", ".", FLEET]);
    let mut types_of_fleet = python(&["mypy", "--package", "fleet"]);
    types_of_fleet.env("MYPYPATH", "../xtask:src");
    let places = ["client-py", "xtask/fleet"].map(str::to_owned);
    let lint = |name: &str, command: Command| {
        let inputs = Inputs { programs: Vec::new(), files: Files::Under(places.clone().into()) };
        Job::new(name, command, Counts::Whole, inputs, 20.0)
    };
    let mut jobs = vec![
        lint("Python lints", ruff),
        lint("Python layers", imports),
        lint("Python formatting", format),
        lint("Python types", python(&["mypy"])),
        lint("Python types of the fleet", types_of_fleet),
    ];
    // A file's tests share servers, so a file stays with one of the two workers.
    let mut pytest = python(&["pytest", "--color=no", "--numprocesses=2", "--dist=loadfile"]);
    if let Some(program) = server {
        pytest.env("PALMARES_SERVER_BIN", program);
    }
    let extension = workspace::root().join("client-py/src/palmares/_native.abi3.so");
    let programs = server.map(Path::to_owned).into_iter().chain([extension]).collect();
    jobs.push(Job::new(
        "Python tests",
        pytest,
        Counts::Pytest,
        Inputs { programs, files: Files::All },
        300.0,
    ));
    jobs
}

/// Checks that are made with the lowest priority while tests run.
fn beside() -> Vec<Job> {
    let all = || Inputs { programs: Vec::new(), files: Files::All };
    let some = |places: &[&str]| Inputs {
        programs: Vec::new(),
        files: Files::Under(places.iter().map(|place| (*place).to_owned()).collect()),
    };
    let mut clippy = idle_cargo();
    clippy.args(["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]);
    let tool = |name: &str, begin: fn() -> Result<Result<Command, String>>, inputs, usual_s| Job {
        name: name.to_owned(),
        begin: Box::new(begin),
        counts: Counts::Whole,
        inputs,
        usual_s,
    };
    vec![
        tool("instruction counts", instructions::counter, all(), 300.0),
        Job::new("Rust lints", clippy, Counts::Whole, all(), 200.0),
        tool("licences and sources of crates", tools::cargo_deny, some(&["Cargo.lock", "deny.toml"]), 3.0),
        tool("workflow files", tools::actionlint, some(&[".github"]), 2.0),
    ]
}

/// Announces a step, runs it and takes its time. A step that cannot run has failed.
fn step(name: &str, body: impl FnOnce() -> Result<Tally>) -> Step {
    println!("\n== {name}");
    let start = Instant::now();
    let tally = body().unwrap_or_else(|error| {
        println!("error: {error:#}");
        Tally { failed: 1, ..Tally::default() }
    });
    Step { name: name.to_owned(), took: start.elapsed(), tally }
}

/// A check that passed, or the printed reason why this machine cannot make it.
fn or_skipped(outcome: std::result::Result<(), String>) -> Result<Tally> {
    match outcome {
        Ok(()) => Ok(PASSED),
        Err(reason) => {
            println!("skipped: {reason}");
            Ok(SKIPPED)
        }
    }
}

/// Runs a command that passes or fails as a whole.
fn whole(command: &mut Command) -> Result<Tally> {
    let status = command.status().with_context(|| format!("cannot start {command:?}"))?;
    Ok(Counts::Whole.read("", status.success()).0)
}
