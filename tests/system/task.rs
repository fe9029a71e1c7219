//! `palmares task` and tasks of one's own: checked, served, played, and verified where their folder is.

use crate::harness::{Client, Official, RULES, Server, get_bytes, official_reset, program};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

const TASK: &str = include_str!("../../tasks/tests/cube.toml");

/// Exit code and what was printed to stdout and stderr.
fn palmares(arguments: &[&str]) -> (i32, String) {
    let output = Command::new(program()).args(arguments).output().expect("palmares runs");
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8")).concat();
    (output.status.code().expect("it ended by itself"), text)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A folder with this task.
fn folder(task: &str) -> TempDir {
    let folder = TempDir::new().expect("temporary directory");
    std::fs::write(folder.path().join("task.toml"), task).expect("written");
    folder
}

/// Opens a run of the task, moves, stops; returns the result and its replay in a folder.
async fn played(server: &Server, into: &TempDir) -> (Value, PathBuf) {
    let (mut client, welcome) = Client::greet(server, "crabs").await;
    let known = welcome["tasks"].as_array().expect("a list").iter().any(|task| task["name"] == "cube");
    assert!(known, "{}", welcome["tasks"]);
    let obs = client.ask(json!({"op": "reset", "task": "cube", "hand": "pinch", "seed": 3})).await;
    assert_eq!((&obs["op"], &obs["run"]["task"]), (&json!("obs"), &json!("cube")), "{obs}");
    let names: Vec<&Value> =
        obs["scene"]["bodies"].as_array().expect("a list").iter().map(|body| &body["name"]).collect();
    assert_eq!(names, ["cube", "post", "ground"]);
    let action =
        json!({"base": {"linear": [0.0, 0.0, -0.1], "angular": [0.0, 0.0, 0.0]}, "hand": [0.5, 0.2]});
    let obs = client.ask(json!({"op": "step", "tick": 0, "repeat": 50, "action": action})).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["op"], "result", "{result}");
    let run_id = result["run_id"].as_str().expect("an id");
    let (status, bytes) = get_bytes(server, &format!("/v1/runs/{run_id}/replay"));
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&bytes));
    let file = into.path().join("run.mcap");
    std::fs::write(&file, bytes).expect("written");
    (result, file)
}

#[tokio::test]
async fn a_task_of_ones_own_is_served_and_verifies_where_its_folder_is() {
    let own = folder(TASK);
    let server = Server::start_with(&["--task", text(own.path())]);
    let into = TempDir::new().expect("temporary directory");
    let (result, file) = played(&server, &into).await;
    drop(server);

    // Anywhere the folder is: a copy does.
    let copy = folder(&format!("# The same, with a comment.\n{TASK}"));
    let (code, out) = palmares(&["verify", text(&file), "--task", text(copy.path()), "--json"]);
    assert_eq!(code, 0, "{out}");
    let verdict: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&verdict["verdict"], &verdict["score"]), (&json!("verified"), &result["score"]), "{out}");

    let (code, out) = palmares(&["verify", text(&file)]);
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains(
            "refused: other_task: neither the program nor a folder given with --task has a task `cube`"
        ),
        "{out}"
    );

    let heavier = folder(&TASK.replace("mass = 0.2", "mass = 0.21"));
    let (code, out) = palmares(&["verify", text(&file), "--task", text(heavier.path())]);
    assert_eq!(code, 1, "{out}");
    let hash = result["task_hash"].as_str().expect("a hash");
    assert!(out.contains("refused: other_task: the task `cube` is another one here: its hash is "), "{out}");
    assert!(out.contains(&format!("recorded was {hash}")), "{out}");

    let (code, out) = palmares(&["verify", text(&file), "--task", text(into.path())]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("task.toml"), "{out}");

    let pictures = into.path().join("pictures.mcap");
    let film = ["replay", text(&file), "--cameras", "wrist", "--out", text(&pictures)];
    let (_, out) = palmares(&film);
    assert!(out.contains("other_task") && !pictures.exists(), "{out}");
}

#[tokio::test]
async fn a_competition_with_task_files_verifies_its_own_runs() {
    let place = TempDir::new().expect("temporary directory");
    std::fs::create_dir(place.path().join("my-task")).expect("made");
    std::fs::write(place.path().join("my-task/task.toml"), TASK).expect("written");
    let rules = format!("task_files = [\"my-task\"]\n{RULES}");
    let cup = Official::start_on(place, &rules, None);
    cup.open();
    let token = cup.team("crabs");
    let (mut client, _) = cup.greet(&token).await;
    let mut request = official_reset();
    (request["task"], request["hand"]) = ("cube".into(), "pinch".into());
    let obs = client.ask(request).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    client.ask(json!({"op": "step", "tick": 0, "repeat": 30, "action": {"hand": [0.5, 0.2]}})).await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["status"]), (&json!("result"), &json!("provisional")), "{result}");
    cup.verified(&result["run_id"]).await;
}

#[test]
fn a_server_refuses_a_task_that_is_wrong_or_has_a_name_that_is_taken() {
    let data = TempDir::new().expect("temporary directory");
    let start = |path: &Path| {
        palmares(&["serve", "--listen", "127.0.0.1:0", "--data-dir", text(data.path()), "--task", text(path)])
    };
    let taken = folder(&TASK.replace("name = \"cube\"\ndescription", "name = \"balls\"\ndescription"));
    let (code, out) = start(taken.path());
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains("task.toml: name = \"balls\" is that of a task of the program; give it another one"),
        "{out}"
    );
    let wrong = folder(&TASK.replace("inside = \"tray\"", "inside = \"try\""));
    let (code, out) = start(wrong.path());
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("task.toml: rules.goals.inside = \"try\" is no region; regions: tray"), "{out}");
}

#[test]
fn a_task_is_checked_shown_and_played() {
    let own = folder(TASK);
    let (code, out) = palmares(&["task", "check", text(own.path()), "--seeds", "3"]);
    assert_eq!(code, 0, "{out}");
    for part in [
        "cube: made up for a test",
        "in_tray: `cube` in `tray`, upright within 10°",
        "3 scenes built",
        ": usable",
    ] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
    let (code, out) = palmares(&["task", "check", text(own.path()), "--json"]);
    let report: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, &report["verdict"], &report["scenes"]), (0, &json!("usable"), &json!(10)), "{out}");
    let hash = report["hash"].as_str().expect("a hash").to_owned();

    let wrong = folder(&TASK.replace("mass = 0.2", "mass = -0.2"));
    let (code, out) = palmares(&["task", "check", text(wrong.path())]);
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains("task.toml: objects.own `cube`: mass: -0.2 kg") && out.contains("not usable"),
        "{out}"
    );
    let falls = folder(&TASK.replace("[0.3, 0.0, 0.05]", "[0.3, 0.0, 0.35]"));
    let (code, out) = palmares(&["task", "check", text(falls.path())]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("seed 1: ") && out.contains("post did not stay where it was put"), "{out}");
    let low = folder(&TASK.replace("position = [0.0, 0.0, 0.6]", "position = [0.0, 0.0, 0.15]"));
    let (code, out) = palmares(&["task", "check", text(low.path()), "--seeds", "1"]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("does not fit where it starts") && out.contains("no hand fits"), "{out}");
    let (code, out) = palmares(&["task", "check", "no-such-task"]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("balls") && out.contains("no-such-task"), "{out}");

    let into = TempDir::new().expect("temporary directory");
    let picture = into.path().join("pan.png");
    let (code, out) = palmares(&["task", "show", "pan", "--out", text(&picture)]);
    assert_eq!(code, 0, "{out}");
    assert!(std::fs::read(&picture).expect("written").starts_with(b"\x89PNG"));
    let (code, out) = palmares(&["task", "show", text(own.path()), "--out", text(&picture)]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("has no camera"), "{out}");

    let replay = into.path().join("idle.mcap");
    let script =
        ["task", "play", text(own.path()), "--hand", "pinch", "--script", "idle", "--replay", text(&replay)];
    let (code, out) = palmares(&script);
    assert_eq!(code, 0, "{out}");
    assert!(out.contains(": 0 points") && out.contains(&hash), "{out}");
    let (code, out) = palmares(&["verify", text(&replay), "--task", text(own.path())]);
    assert_eq!(code, 0, "{out}");
}

/// The guide shows the files of a task and what the program prints of it.
#[test]
fn the_guide_shows_a_task_that_is_usable() {
    let guide = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/tasks.md"))
        .expect("the guide");
    let block =
        guide.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a task.toml");
    let own = folder(block);
    let (code, out) = palmares(&["task", "check", text(own.path()), "--seeds", "2"]);
    assert_eq!(code, 0, "{out}");
    let shown =
        guide.split("$ palmares task check my-task/\n").nth(1).and_then(|rest| rest.split("```").next());
    let lines =
        shown.expect("the guide shows a check").lines().filter(|line| !line.is_empty() && *line != "...");
    for line in lines
        .filter(|line| !line.contains("my-task/") && !line.starts_with("hash ") && !line.contains("scenes"))
    {
        assert!(out.lines().any(|printed| printed == line), "not printed: {line}\nbut:\n{out}");
    }
}

/// Every task that comes with the program can be begun with: its copy is a task of one's own that is usable.
#[test]
fn a_copy_of_each_task_is_a_task_of_ones_own() {
    let into = TempDir::new().expect("temporary directory");
    for task in ["balls", "shelf", "grasp", "pan", "peg"] {
        let own = into.path().join(format!("my-{task}"));
        let (code, printed) = palmares(&["task", "copy", task, text(&own)]);
        assert_eq!(code, 0, "{printed}");
        let (code, printed) = palmares(&["task", "check", text(&own), "--seeds", "1"]);
        assert!(code == 0 && printed.contains(&format!("my-{task}")), "{printed}");
        let file = own.join("task.toml");
        std::fs::write(&file, "changed since").expect("written");
        let (code, printed) = palmares(&["task", "copy", task, text(&own)]);
        assert!(code != 0 && printed.contains("is there already"), "{printed}");
        assert_eq!(std::fs::read_to_string(&file).expect("read"), "changed since");
    }
}

#[test]
fn a_copy_needs_a_task_of_the_program_and_a_name_of_its_own() {
    let into = TempDir::new().expect("temporary directory");
    let own = into.path().join("mine");
    for (arguments, told) in [
        (["task", "copy", "bals", text(&own)].as_slice(), "balls, shelf, grasp, pan, peg"),
        (&["task", "copy", "balls", text(&own), "--name", "pan"], "`pan` comes with the program"),
        (&["task", "copy", "balls", text(&own), "--name", "a\"b"], "valid: 1 to 64 letters"),
    ] {
        let (code, printed) = palmares(arguments);
        assert!(code != 0 && printed.contains(told), "{printed}");
        assert!(!own.exists(), "nothing is written");
    }
}
