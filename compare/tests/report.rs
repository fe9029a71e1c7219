//! `palmares-compare report`, as it is started: a peer that does not return is played in a child of the program.

use palmares_compare::report::dominance::Verdict;
use palmares_compare::report::{Comparison, runner};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palmares-compare"));
    command.args(["report", "--quick", "--repeats", "1", "--out"]).arg(folder);
    command.arg("--runs").arg(folder.join("runs.jsonl")).args(arguments);
    command
}

fn report(folder: &Path, arguments: &[&str]) -> Comparison {
    let status = command(folder, arguments).status().expect("it starts");
    assert!(status.success(), "{status}");
    runner::read(&folder.join("report.json")).expect("it wrote a report")
}

#[test]
fn a_small_report_is_complete_and_can_be_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let made = report(folder, &["--engines", "own,rapier", "--cases", "bowling", "--steps-ms", "2,8"]);
    assert_eq!(made.runs.len(), 6);
    for run in made.runs.iter().filter(|run| run.settings != "default" || run.engine == "own") {
        assert_eq!(run.trouble, None, "{run:?}");
        assert!(run.cpu_s > 0.0 && run.usable_error().is_some(), "{run:?}");
    }
    assert_eq!(made.results.len(), 1);
    let stiff = made.results[0].settings.iter().find(|outcome| outcome.settings == "stiff120");
    let stiff = stiff.expect("it was among them");
    assert_eq!((stiff.done, stiff.tried), (2, 2), "rapier rolls a ball");
    assert!(made.ticks.iter().all(|way| way.lifted), "the pan is lifted both ways");
    for file in ["README.md", "report.json", "bowling.svg", "stable.svg", "split.svg", "ticks.svg"] {
        let text = fs::read_to_string(folder.join(file)).expect("the report wrote it");
        assert!(text.contains("bowling") || file == "ticks.svg", "{file}");
    }
    let json = folder.join("report.json");
    assert_eq!(runner::check(&json).is_ok(), made.results[0].verdict() != Verdict::Lost);
    let page = fs::read_to_string(folder.join("README.md")).expect("written");
    runner::rewrite(&json).expect("it can be judged again");
    assert_eq!(fs::read_to_string(folder.join("README.md")).expect("written"), page);
}

/// The outcomes that the program has played, by engine.
fn played(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join("runs.jsonl")).expect("it wrote runs");
    let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    lines.map(|line| line["run"]["engine"].as_str().expect("an engine").to_owned()).collect()
}

const BALL: [&str; 6] = ["--engines", "own,rapier", "--cases", "incline_sphere", "--steps-ms", "4,8"];

#[test]
fn a_second_report_plays_ours_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let first = report(folder, &BALL);
    assert_eq!(played(folder), ["own", "own", "rapier", "rapier", "rapier", "rapier"]);
    let again = |more: &[&str]| {
        fs::remove_file(folder.join("runs.jsonl")).expect("it was written");
        report(folder, &[&BALL[..], more].concat())
    };
    let second = again(&[]);
    assert_eq!(played(folder), ["own", "own"]);
    let of_peer = |report: &Comparison| {
        let runs = report.runs.iter().filter(|run| run.engine == "rapier").cloned();
        let runs: Vec<_> =
            runs.map(|run| palmares_compare::report::comparison::Run { kept: None, ..run }).collect();
        serde_json::to_string(&runs).expect("JSON")
    };
    assert_eq!(of_peer(&second), of_peer(&first), "a quick report leaves kept times as they are");
    for run in &second.runs {
        let from = run.kept.as_ref().map(|kept| &kept.commit);
        assert_eq!(from, (run.engine == "rapier").then_some(&first.record.commit), "{run:?}");
    }
    assert!(second.sentinels.is_some_and(|sentinels| sentinels.played > 0), "{:?}", second.sentinels);
    let page = fs::read_to_string(folder.join("README.md")).expect("written");
    assert!(page.contains(&format!("4 runs of commit {}", first.record.commit)), "the page says so");
    again(&["--run-limit-s", "59"]);
    assert_eq!(played(folder).len(), 6, "another limit is another run");
    again(&["--run-limit-s", "59", "--peers-anew"]);
    assert_eq!(played(folder).len(), 6);
}

#[test]
fn a_sentinel_that_plays_otherwise_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    report(folder, &BALL);
    let json = folder.join("report.json");
    let mut report: Value = serde_json::from_str(&fs::read_to_string(&json).expect("written")).expect("JSON");
    for run in report["runs"].as_array_mut().expect("runs").iter_mut().filter(|run| run["engine"] == "rapier")
    {
        let value = &mut run["error"]["value"];
        *value = json!(f64::from_bits(value.as_f64().expect("a figure").to_bits() + 1));
    }
    fs::write(&json, report.to_string()).expect("written");
    let output = command(folder, &BALL).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        !output.status.success() && said.contains("otherwise here") && said.contains("--peers-anew"),
        "{said}"
    );
}

#[test]
fn a_second_count_of_grasps_plays_ours_and_sentinels() {
    let folder = tempfile::tempdir().expect("a folder");
    let (out, runs) = (folder.path().join("out"), folder.path().join("runs.jsonl"));
    let count = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palmares-compare"));
        command.args(["grasps", "--engine", "own,rapier", "--settings", "default", "--hand", "softhand"]);
        command.args(["--family", "ball", "--placements", "1", "--steps-ms", "16", "--peer-steps-ms", "16"]);
        // In a build for tests it does not end in this time: an ending as any other.
        command.args(["--run-limit-s", "1", "--out"]).arg(&out).arg("--runs").arg(&runs);
        assert!(command.status().expect("it starts").success());
        let text = fs::read_to_string(&runs).expect("it wrote runs");
        fs::remove_file(&runs).expect("it is there");
        let engine = |line: &str| serde_json::from_str::<Value>(line).expect("JSON")["run"]["engine"].clone();
        text.lines().map(engine).collect::<Vec<_>>()
    };
    assert_eq!(count(), ["own", "rapier"]);
    assert_eq!(count(), ["own"]);
    let page = fs::read_to_string(out.join("README.md")).expect("written");
    assert!(page.contains("1 runs of commit") && page.contains("rapier `default`"), "{page}");
}

/// rapier plays this scene for minutes in a build of tests.
#[test]
fn a_run_that_never_ends_is_not_finished_and_the_next_one_is_played() {
    let folder = tempfile::tempdir().expect("a folder");
    let runs = folder.path().join("runs.jsonl");
    let status = Command::new(env!("CARGO_BIN_EXE_palmares-compare"))
        .args(["report", "--quick", "--outcomes-only", "--jobs", "1", "--run-limit-s", "2"])
        .args(["--engines", "rapier", "--cases", "softhand_cylinder,incline_sphere"])
        .args(["--steps-ms", "16", "--runs"])
        .arg(&runs)
        .status()
        .expect("it starts");
    assert!(status.success(), "{status}");
    let text = fs::read_to_string(&runs).expect("it wrote runs");
    let said = |case: &str| {
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let run = lines
            .map(|line| line["run"].clone())
            .find(|run| run["case"] == case && run["engine"] == "rapier" && run["settings"] == "default");
        run.expect("it was played")
    };
    let never = said("softhand_cylinder");
    assert_eq!((&never["unfinished"], &never["trouble"]), (&json!(true), &json!("not finished within 2 s")));
    // A ball on a slope, which takes milliseconds.
    assert_eq!(said("incline_sphere")["unfinished"], false);
}
