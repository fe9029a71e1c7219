//! Numbers of tests, read from what their programs print.

use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::time::Duration;

/// Numbers of tests. A check that is not made of tests, such as a linter, counts as one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Tally {
    pub(super) passed: u32,
    #[serde(skip)]
    pub(super) failed: u32,
    pub(super) skipped: u32,
    /// Passed in an earlier run, with the same files.
    #[serde(skip)]
    pub(super) kept: u32,
}

/// A check with its time and its tests.
pub(super) struct Step {
    pub(super) name: String,
    pub(super) took: Duration,
    pub(super) tally: Tally,
}

/// A check that passed as a whole, and one that failed.
pub(super) const PASSED: Tally = Tally { passed: 1, failed: 0, skipped: 0, kept: 0 };
pub(super) const FAILED: Tally = Tally { passed: 0, failed: 1, skipped: 0, kept: 0 };
pub(super) const SKIPPED: Tally = Tally { passed: 0, failed: 0, skipped: 1, kept: 0 };

impl Tally {
    pub(super) fn plus(self, other: Tally) -> Tally {
        Tally {
            passed: self.passed + other.passed,
            failed: self.failed + other.failed,
            skipped: self.skipped + other.skipped,
            kept: self.kept + other.kept,
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)?;
        if self.kept > 0 { write!(f, ", {} kept", self.kept) } else { Ok(()) }
    }
}

/// How to count what a program prints.
#[derive(Clone, Copy, Debug)]
pub(super) enum Counts {
    /// One check, by its exit status.
    Whole,
    /// A Rust test program with `--show-output`.
    Rust,
    Pytest,
    Playwright,
    Vitest,
}

impl Counts {
    /// The tests in an output, and the output to show.
    pub(super) fn read(self, printed: &str, success: bool) -> (Tally, String) {
        let (mut tally, shown) = match self {
            Counts::Whole => (if success { PASSED } else { FAILED }, printed.to_owned()),
            Counts::Rust => rust(printed),
            Counts::Pytest => (last(printed, pytest), printed.to_owned()),
            Counts::Playwright => (all(printed, playwright), printed.to_owned()),
            Counts::Vitest => (last(printed, vitest), printed.to_owned()),
        };
        // Something other than a test failed: the program crashed, say.
        if !success && tally.failed == 0 {
            tally.failed = 1;
        }
        (tally, shown)
    }
}

fn last(printed: &str, read: fn(&str) -> Option<Tally>) -> Tally {
    printed.lines().rev().find_map(read).unwrap_or_default()
}

fn all(printed: &str, read: fn(&str) -> Option<Tally>) -> Tally {
    printed.lines().filter_map(read).fold(Tally::default(), Tally::plus)
}

/// A test that passes and prints a line that begins with `SKIP` was skipped; one that prints `LEFT OUT` made less than it could. Other
/// output of tests that pass is not shown.
fn rust(printed: &str) -> (Tally, String) {
    let (mut tally, mut shown) = (Tally::default(), String::new());
    // Within the output of tests that passed: the name of the present one.
    let mut passed: Option<&str> = None;
    let mut skipped = BTreeSet::new();
    for line in printed.lines() {
        let name = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----"));
        match line {
            "successes:" => passed = Some(""),
            "failures:" => passed = None,
            _ if line.starts_with("test result: ") => passed = None,
            _ => {}
        }
        match (passed, name) {
            (Some(_), Some(name)) => passed = Some(name),
            (Some(name), None) if line.starts_with("SKIP") || line.starts_with("LEFT OUT") => {
                if line.starts_with("SKIP") {
                    skipped.insert(name);
                }
                shown += &format!("{name}: {line}\n");
            }
            (Some(_), None) => {}
            (None, _) => shown += &format!("{line}\n"),
        }
        // `test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; …`
        if let Some((_, counts)) = line.strip_prefix("test result: ").and_then(|rest| rest.split_once(". ")) {
            tally = tally.plus(numbers(counts, ';'));
        }
    }
    let unrun = skipped.len() as u32;
    tally.passed = tally.passed.saturating_sub(unrun);
    tally.skipped += unrun;
    (tally, shown)
}

/// `===== 20 passed, 1 skipped in 1.82s =====`, also without the bars.
fn pytest(line: &str) -> Option<Tally> {
    let (counts, time) = line.trim_matches(['=', ' ']).rsplit_once(" in ")?;
    let seconds = time.split(' ').next()?.strip_suffix('s')?;
    seconds.parse::<f64>().ok()?;
    Some(numbers(counts, ','))
}

/// `  11 passed (3.0m)`, `  1 failed`, `  2 skipped`, `  8 did not run`.
fn playwright(line: &str) -> Option<Tally> {
    let (number, kind) = line.trim().split_once(' ')?;
    number.parse::<u32>().ok()?;
    let kind = kind.split(" (").next()?;
    matches!(kind, "passed" | "flaky" | "failed" | "interrupted" | "skipped" | "did not run")
        .then(|| numbers(&format!("{number} {kind}"), ','))
}

/// `      Tests  109 passed | 2 skipped (111)`.
fn vitest(line: &str) -> Option<Tally> {
    let counts = line.trim().strip_prefix("Tests ")?;
    Some(numbers(counts.split('(').next()?, '|'))
}

fn numbers(text: &str, separator: char) -> Tally {
    let mut tally = Tally::default();
    for part in text.split(separator) {
        let Some((number, kind)) = part.trim().split_once(' ') else { continue };
        let Ok(number) = number.parse::<u32>() else { continue };
        match kind.trim() {
            "passed" | "xpassed" | "flaky" => tally.passed += number,
            "failed" | "error" | "errors" | "interrupted" => tally.failed += number,
            "ignored" | "skipped" | "xfailed" | "did not run" => tally.skipped += number,
            _ => {}
        }
    }
    tally
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally(passed: u32, failed: u32, skipped: u32) -> Tally {
        Tally { passed, failed, skipped, kept: 0 }
    }

    #[test]
    fn a_rust_test_that_says_skip_has_not_passed() {
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
LEFT OUT: a command

successes:
    a
    b

failures:

---- c stdout ----
SKIP is not what a failed test says
test result: FAILED. 2 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.02s
";
        let (counted, shown) = Counts::Rust.read(printed, false);
        assert_eq!(counted, tally(1, 1, 3));
        assert!(shown.contains("a: SKIP: postgres is not installed\n"), "{shown}");
        assert!(shown.contains("b: LEFT OUT: a command\n"), "{shown}");
        assert!(shown.contains("SKIP is not what a failed test says\n"), "{shown}");
        assert!(!shown.contains("noise"), "{shown}");
        let fine =
            "test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n";
        assert_eq!(Counts::Rust.read(fine, true).0, tally(1, 0, 0));
    }

    #[test]
    fn counts_of_other_programs_are_read() {
        let of = |counts: Counts, printed: &str| counts.read(printed, true).0;
        let quiet = "noise\n20 passed, 2 skipped, 13 warnings in 1.67s\n";
        assert_eq!(of(Counts::Pytest, quiet), tally(20, 0, 2));
        let loud = "===== 1 failed, 3 passed, 1 error in 61.02s (0:01:01) =====";
        assert_eq!(of(Counts::Pytest, loud), tally(3, 2, 0));
        assert_eq!(
            of(
                Counts::Playwright,
                "  1 failed\n    a.spec.ts:3:1 a b\n  8 did not run\n  11 passed (3.0m)\n"
            ),
            tally(11, 1, 8)
        );
        assert_eq!(
            of(Counts::Vitest, " Test Files  36 passed (36)\n      Tests  109 passed | 2 skipped (111)\n"),
            tally(109, 0, 2)
        );
    }

    #[test]
    fn a_program_that_fails_without_a_failed_test_has_failed() {
        assert_eq!(Counts::Whole.read("", false).0, FAILED);
        assert_eq!(Counts::Pytest.read("20 passed in 1.67s", false).0, tally(20, 1, 0));
    }
}
