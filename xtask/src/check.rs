//! `cargo xtask test`: every check, some of them beside the tests, with a summary.

use crate::apt;
use crate::cargo::{build_for_tests, cargo, idle_cargo};
use crate::docker;
use crate::instructions;
use crate::python::Environment;
use crate::tools;
use crate::viewer::Viewer;
use anyhow::{Context, Result};
use std::collections::BTreeSet;
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
        // A test that finds no program or data prints so: the output of those that pass is read, too.
        tests.args(["test", "--workspace", "--no-fail-fast", "--", "--show-output"]);
        if std::env::var_os(TEST_THREADS).is_none() {
            // Tests of servers wait for more than a third of their time.
            let cores = thread::available_parallelism().map_or(1, usize::from);
            tests.env(TEST_THREADS, (cores + cores.div_ceil(2)).to_string());
        }
        if let Some(program) = &server {
            tests.env("PALMARES_SERVER_BIN", program);
        }
        counted(&mut tests, RustTests::default())
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
            counted(pages.env("PALMARES_SERVER_BIN", program).env("PALMARES_CHROMIUM", chromium), page_tests)
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

/// Reads the output of a program of tests, line by line.
trait Reader {
    /// The tests that a line reports, and the line to show, if any.
    fn read(&mut self, line: &str) -> (Tally, Option<String>);
}

impl<F: Fn(&str) -> Option<Tally>> Reader for F {
    fn read(&mut self, line: &str) -> (Tally, Option<String>) {
        (self(line).unwrap_or_default(), Some(line.to_owned()))
    }
}

/// Runs a command, shows its standard output meanwhile and counts the tests that it reports.
fn counted(command: &mut Command, mut reader: impl Reader) -> Result<Tally> {
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("cannot start {command:?}"))?;
    let mut tally = Tally::default();
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines() {
            let (tests, shown) = reader.read(&line?);
            tally = tally.plus(tests);
            if let Some(shown) = shown {
                println!("{shown}");
            }
        }
    }
    // Something other than a test failed: a crate does not compile, or a test program crashed.
    if !child.wait()?.success() && tally.failed == 0 {
        tally.failed = 1;
    }
    Ok(tally)
}

/// Output of `cargo test -- --show-output`. A test that passes and prints a line that begins with `SKIP` was skipped; other
/// output of tests that pass is not shown.
#[derive(Default)]
struct RustTests {
    /// Within the output of tests that passed: the present one.
    passed: Option<String>,
    /// Those of the present program that were skipped.
    skipped: BTreeSet<String>,
}

impl Reader for RustTests {
    fn read(&mut self, line: &str) -> (Tally, Option<String>) {
        if let Some(counts) = line.strip_prefix("test result: ").and_then(|rest| rest.split_once(". ")) {
            let mut tally = read_counts(counts.1, ';');
            let skipped = std::mem::take(&mut self.skipped).len() as u32;
            tally.passed = tally.passed.saturating_sub(skipped);
            tally.skipped += skipped;
            self.passed = None;
            let note =
                if skipped > 0 { format!(" ({skipped} of the passed ones skipped)") } else { String::new() };
            return (tally, Some(format!("{line}{note}")));
        }
        let begins =
            |of: &str| line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(of)).map(str::to_owned);
        match (line, begins(" stdout ----")) {
            ("successes:", _) => self.passed = Some(String::new()),
            ("failures:", _) => self.passed = None,
            (_, Some(name)) if self.passed.is_some() => self.passed = Some(name),
            (_, _) => {
                let Some(name) = &self.passed else { return (Tally::default(), Some(line.to_owned())) };
                if line.starts_with("SKIP") {
                    self.skipped.insert(name.clone());
                    return (Tally::default(), Some(format!("{name}: {line}")));
                }
                return (Tally::default(), None);
            }
        }
        (Tally::default(), self.passed.is_none().then(|| line.to_owned()))
    }
}

/// `  11 passed (3.0m)`, `  1 failed`, `  2 skipped`, `  8 did not run`.
fn page_tests(line: &str) -> Option<Tally> {
    let (number, kind) = line.trim().split_once(' ')?;
    let number = number.parse().ok()?;
    let none = Tally::default();
    match kind.split(" (").next()? {
        "passed" | "flaky" => Some(Tally { passed: number, ..none }),
        "failed" | "interrupted" => Some(Tally { failed: number, ..none }),
        "skipped" | "did not run" => Some(Tally { skipped: number, ..none }),
        _ => None,
    }
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
    fn counts_of_cargo_test_are_read_and_a_test_that_says_skip_has_not_passed() {
        let printed = "\
running 3 tests
test a ... ok
test b ... ok
test c ... FAILED

successes:

---- a stdout ----
SKIP: postgres is not installed
SKIP: a second time

---- b stdout ----
noise

successes:
    a
    b

failures:

---- c stdout ----
SKIP is not what a failed test says
test result: FAILED. 2 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.02s
running 1 test
test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s";
        let mut reader = RustTests::default();
        let (mut tally, mut shown) = (Tally::default(), Vec::new());
        for line in printed.lines() {
            let (tests, line) = reader.read(line);
            tally = tally.plus(tests);
            shown.extend(line);
        }
        assert_eq!(tally, Tally { passed: 2, failed: 1, skipped: 3 });
        assert!(shown.contains(&"a: SKIP: postgres is not installed".to_owned()), "{shown:#?}");
        assert!(shown.contains(&"SKIP is not what a failed test says".to_owned()), "{shown:#?}");
        assert!(!shown.iter().any(|line| line.contains("noise")), "{shown:#?}");
    }

    #[test]
    fn counts_of_playwright_are_read() {
        let read = |line| page_tests(line).unwrap_or_default();
        assert_eq!(
            read("  11 passed (3.0m)").plus(read("  1 failed")).plus(read("  8 did not run")),
            Tally { passed: 11, failed: 1, skipped: 8 }
        );
        assert_eq!(page_tests("  \u{2713}  1 tests/board.spec.ts:3:1 \u{203a} a board (1.2s)"), None);
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
