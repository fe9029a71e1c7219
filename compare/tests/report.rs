//! `palmares-compare report`, as it is started: a peer that does not return is played in a child of the program.

use palmares_compare::report::dominance::Verdict;
use palmares_compare::report::{Comparison, runner};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;

fn report(folder: &Path, arguments: &[&str]) -> Comparison {
    let status = Command::new(env!("CARGO_BIN_EXE_palmares-compare"))
        .args(["report", "--quick", "--repeats", "1", "--out"])
        .arg(folder)
        .arg("--runs")
        .arg(folder.join("runs.jsonl"))
        .args(arguments)
        .status()
        .expect("it starts");
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

#[test]
fn runs_of_an_engine_that_is_not_played_are_kept_from_an_earlier_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let cases = ["--cases", "incline_sphere", "--steps-ms", "4,8"];
    let both = report(folder, &[&["--engines", "own,rapier"], &cases[..]].concat());
    let earlier = folder.join("earlier.json");
    fs::rename(folder.join("report.json"), &earlier).expect("it was written");
    let keep = ["--engines", "own", "--keep", earlier.to_str().expect("a name")];
    let kept = report(folder, &[&keep, &cases[..]].concat());
    let of_peer = |report: &Comparison| {
        let runs: Vec<_> = report.runs.iter().filter(|run| run.engine == "rapier").collect();
        serde_json::to_string(&runs).expect("JSON")
    };
    assert_eq!(of_peer(&kept), of_peer(&both));
    assert_eq!(kept.runs.len(), 6);
    assert_eq!(kept.results.len(), 1);
    let note = kept.engines.iter().find(|note| note.name == "rapier").expect("a note");
    let kept_from = note.kept_from.as_ref().expect("it says where it is from");
    assert_eq!(kept_from.commit, both.record.commit);
    let page = fs::read_to_string(folder.join("README.md")).expect("written");
    assert!(page.contains("its runs and their times are those of commit"), "the page says so");
}

/// rapier does not return from a step of this scene.
#[test]
fn a_run_that_never_ends_is_not_finished_and_the_next_one_is_played() {
    let folder = tempfile::tempdir().expect("a folder");
    let runs = folder.path().join("runs.jsonl");
    let status = Command::new(env!("CARGO_BIN_EXE_palmares-compare"))
        .args(["report", "--quick", "--outcomes-only", "--jobs", "1", "--run-limit-s", "2"])
        .args(["--engines", "rapier", "--cases", "dense_heap_and_hand,incline_sphere"])
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
    let never = said("dense_heap_and_hand");
    assert_eq!((&never["unfinished"], &never["trouble"]), (&json!(true), &json!("not finished within 2 s")));
    // A ball on a slope, which takes milliseconds.
    assert_eq!(said("incline_sphere")["unfinished"], false);
}
