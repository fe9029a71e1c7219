//! `cargo xtask test`: every check, some of them beside the tests, with a summary.

use crate::apt;
use crate::cargo::{build_for_tests, cargo, idle_cargo};
use crate::docker;
use crate::instructions;
use crate::python::Environment;
use crate::tools;
use crate::viewer::Viewer;
use anyhow::{Context, Result};
use std::fmt;
use std::io::{BufRead, BufReader};
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

/// Numbers of tests. A check that is not made of tests, such as a linter, counts as one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Tally {
    passed: u32,
    failed: u32,
    skipped: u32,
}

/// The Python of `cargo xtask fleet`, from `client-py`.
const FLEET: &str = "../xtask/fleet";

/// A check that passed as a whole.
const PASSED: Tally = Tally { passed: 1, failed: 0, skipped: 0 };

impl Tally {
    fn plus(self, other: Tally) -> Tally {
        Tally {
            passed: self.passed + other.passed,
            failed: self.failed + other.failed,
            skipped: self.skipped + other.skipped,
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

struct Step {
    name: &'static str,
    took: Duration,
    tally: Tally,
}

/// How many tests of a program run at once.
const TEST_THREADS: &str = "RUST_TEST_THREADS";

/// Runs everything, also after a failure, and returns whether all of it passed.
pub(crate) fn run() -> Result<bool> {
    let mut viewer = None;
    let mut steps = vec![step("viewer", || {
        let made = Viewer::prepare()?;
        made.build()?;
        viewer = Some(made);
        Ok(PASSED)
    })];
    if let Some(viewer) = &viewer {
        steps
            .push(step("viewer's types and lints", || whole(&mut viewer.npm(&["run", "--silent", "check"]))));
        steps.push(step("viewer's tests", || whole(&mut viewer.npm(&["test", "--silent"]))));
    }
    steps.extend([
        step("Rust formatting", || whole(cargo().args(["fmt", "--all", "--check"]))),
        step("Postgres for the tests", || {
            let missing = "Postgres is not installed (Debian's package `postgresql`), and could not be";
            or_skipped(apt::postgres().then_some(()).ok_or_else(|| missing.to_owned()))
        }),
    ]);
    let mut environment = None;
    steps.push(step("Python environment", || {
        environment = Some(Environment::prepare()?);
        Ok(PASSED)
    }));
    let mut server = None;
    steps.push(step("build of tests, server and Python extension", || {
        server = Some(build_for_tests()?);
        Ok(PASSED)
    }));
    let beside = begin_beside();
    steps.push(step("Rust tests", || {
        let mut tests = cargo();
        tests.args(["test", "--workspace", "--no-fail-fast"]);
        if std::env::var_os(TEST_THREADS).is_none() {
            // Tests of servers wait for more than a third of their time.
            let cores = thread::available_parallelism().map_or(1, usize::from);
            tests.env(TEST_THREADS, (cores + cores.div_ceil(2)).to_string());
        }
        if let Some(program) = &server {
            tests.env("PALMARES_SERVER_BIN", program);
        }
        counted(&mut tests, rust_tests)
    }));
    if let (Some(viewer), Some(program)) = (&viewer, &server) {
        steps.push(step("pages in Chromium", || {
            let Some(chromium) = apt::chromium() else {
                let missing = "Chromium is not installed (Debian's package `chromium`), and could not be";
                return or_skipped(Err(missing.to_owned()));
            };
            let mut pages = viewer.npm(&["run", "--silent", "pages"]);
            if let Some(environment) = &environment {
                pages.env("PALMARES_CLIENT_PYTHON", environment.interpreter());
            }
            whole(pages.env("PALMARES_SERVER_BIN", program).env("PALMARES_CHROMIUM", chromium))
        }));
    }
    if let Some(environment) = &environment {
        let python = |arguments: &[&str]| {
            let mut command = environment.python();
            command.args(["-m"]).args(arguments);
            command
        };
        steps.push(step("Python lints", || {
            let mut imports = environment.tool("lint-imports");
            let imports = imports.args(["--no-cache", "--no-logo"]);
            Ok(whole(&mut python(&["ruff", "check", "--config", "pyproject.toml", ".", FLEET]))?
                .plus(whole(imports)?))
        }));
        steps.push(step("Python formatting", || {
            whole(&mut python(&["ruff", "format", "--check", "--config", "pyproject.toml", ".", FLEET]))
        }));
        steps.push(step("Python types", || {
            let mut fleet = python(&["mypy", "--package", "fleet"]);
            Ok(whole(&mut python(&["mypy"]))?.plus(whole(fleet.env("MYPYPATH", "../xtask:src"))?))
        }));
        steps.push(step("Python tests", || {
            // A file's tests share servers, so a file stays with one of the two workers.
            let mut pytest = python(&["pytest", "--color=no", "--numprocesses=2", "--dist=loadfile"]);
            if let Some(program) = &server {
                pytest.env("PALMARES_SERVER_BIN", program);
            }
            counted(&mut pytest, python_tests)
        }));
    }
    steps.extend(end_beside(&beside));
    if let (Some(program), Some(environment)) = (&server, &environment) {
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

/// What a check printed, or the reason why this machine cannot make it.
type Printed = Result<std::result::Result<Output, String>>;
/// Makes a check.
type Check = fn() -> Printed;

/// Checks that are made with the lowest priority while tests run, which leave the processors idle for a third of their time.
const BESIDE: [(&str, Check); 4] = [
    ("instruction counts", || printed(instructions::counter()?)),
    ("Rust lints", || {
        let mut clippy = idle_cargo();
        clippy.args(["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]);
        printed(Ok(clippy))
    }),
    ("licences and sources of crates", || printed(tools::cargo_deny()?)),
    ("workflow files", || printed(tools::actionlint()?)),
];

/// Begins the checks beside the tests. The build is before: cargo lets one command at a time into the target directory.
fn begin_beside() -> Receiver<Printed> {
    let (send, made) = mpsc::channel();
    thread::spawn(move || BESIDE.iter().all(|(_, check)| send.send(check()).is_ok()));
    made
}

/// Waits for the checks beside the tests; the time of a step is that of waiting.
fn end_beside(made: &Receiver<Printed>) -> Vec<Step> {
    BESIDE
        .iter()
        .map(|(name, _)| {
            step(name, || match made.recv().context("it panicked; see above")?? {
                Ok(Output { status, stdout, stderr }) => {
                    println!("{}{}", String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
                    Ok(of_status(status))
                }
                Err(reason) => or_skipped(Err(reason)),
            })
        })
        .collect()
}

/// Runs a command, where this machine has it, and keeps what it prints.
fn printed(command: std::result::Result<Command, String>) -> Printed {
    Ok(match command {
        Ok(mut command) => Ok(command.output().with_context(|| format!("cannot start {command:?}"))?),
        Err(reason) => Err(reason),
    })
}

/// Announces a step, runs it and takes its time. A step that cannot run has failed.
fn step(name: &'static str, body: impl FnOnce() -> Result<Tally>) -> Step {
    println!("\n== {name}");
    let start = Instant::now();
    let tally = body().unwrap_or_else(|error| {
        println!("error: {error:#}");
        Tally { failed: 1, ..Tally::default() }
    });
    Step { name, took: start.elapsed(), tally }
}

/// A check that passed, or the printed reason why this machine cannot make it.
fn or_skipped(outcome: std::result::Result<(), String>) -> Result<Tally> {
    match outcome {
        Ok(()) => Ok(PASSED),
        Err(reason) => {
            println!("skipped: {reason}");
            Ok(Tally { skipped: 1, ..Tally::default() })
        }
    }
}

/// Runs a command that passes or fails as a whole.
fn whole(command: &mut Command) -> Result<Tally> {
    command.status().map(of_status).with_context(|| format!("cannot start {command:?}"))
}

fn of_status(status: ExitStatus) -> Tally {
    let passed = u32::from(status.success());
    Tally { passed, failed: 1 - passed, skipped: 0 }
}

/// Runs a command, shows its standard output meanwhile and counts the tests that it reports.
fn counted(command: &mut Command, read: fn(&str) -> Option<Tally>) -> Result<Tally> {
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("cannot start {command:?}"))?;
    let mut tally = Tally::default();
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines() {
            let line = line?;
            println!("{line}");
            tally = tally.plus(read(&line).unwrap_or_default());
        }
    }
    // Something other than a test failed: a crate does not compile, or a test program crashed.
    if !child.wait()?.success() && tally.failed == 0 {
        tally.failed = 1;
    }
    Ok(tally)
}

/// `test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; …`
fn rust_tests(line: &str) -> Option<Tally> {
    let (_, counts) = line.strip_prefix("test result: ")?.split_once(". ")?;
    Some(read_counts(counts, ';'))
}

/// `===== 20 passed, 1 skipped in 1.82s =====`, also without the bars.
fn python_tests(line: &str) -> Option<Tally> {
    let (counts, time) = line.trim_matches(['=', ' ']).rsplit_once(" in ")?;
    let seconds = time.split(' ').next()?.strip_suffix('s')?;
    seconds.parse::<f64>().ok()?;
    Some(read_counts(counts, ','))
}

fn read_counts(text: &str, separator: char) -> Tally {
    let mut tally = Tally::default();
    for part in text.split(separator) {
        let Some((number, kind)) = part.trim().split_once(' ') else { continue };
        let Ok(number) = number.parse::<u32>() else { continue };
        match kind {
            "passed" | "xpassed" => tally.passed += number,
            "failed" | "error" | "errors" => tally.failed += number,
            "ignored" | "skipped" | "xfailed" => tally.skipped += number,
            _ => {}
        }
    }
    tally
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_cargo_test_are_read() {
        let line = "test result: FAILED. 3 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.02s";
        assert_eq!(rust_tests(line), Some(Tally { passed: 3, failed: 1, skipped: 2 }));
        assert_eq!(rust_tests("test solver::rests ... ok"), None);
    }

    #[test]
    fn counts_of_pytest_are_read() {
        let quiet = "20 passed, 2 skipped, 13 warnings in 1.67s";
        assert_eq!(python_tests(quiet), Some(Tally { passed: 20, failed: 0, skipped: 2 }));
        let loud = "===== 1 failed, 3 passed, 1 error in 61.02s (0:01:01) =====";
        assert_eq!(python_tests(loud), Some(Tally { passed: 3, failed: 2, skipped: 0 }));
        assert_eq!(python_tests("platform linux -- Python 3.11"), None);
    }
}
