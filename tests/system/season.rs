//! Many replays verified at once: folders, buckets, an interrupted verification.

use crate::harness::{Client, Official, Server, get, get_bytes, official_reset, program, reset};
use crate::objects::{moto, python};
use serde_json::{Value, json};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// A folder with two sound replays, one of them deeper, a damaged one and another file. Also the server's key.
async fn season() -> (TempDir, String) {
    let server = Server::start();
    let folder = TempDir::new().expect("temporary directory");
    std::fs::create_dir_all(folder.path().join("day2/late")).expect("folder");
    let (mut client, _) = Client::greet(&server, "crabs").await;
    for name in ["a.mcap", "day2/late/b.mcap"] {
        assert_eq!(client.ask(reset()).await["op"], "obs");
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 30})).await;
        let result = client.ask(json!({"op": "stop"})).await;
        let run_id = result["run_id"].as_str().expect("an id");
        let (_, bytes) = get_bytes(&server, &format!("/v1/runs/{run_id}/replay"));
        std::fs::write(folder.path().join(name), &bytes).expect("written");
        std::fs::write(folder.path().join("day2/cut.mcap"), &bytes[..bytes.len() / 2]).expect("written");
    }
    std::fs::write(folder.path().join("day2/notes.txt"), "no replay").expect("written");
    let key = get(&server, "/v1/competition").json()["replay_key"].as_str().expect("a key").to_owned();
    (folder, key)
}

fn verify(arguments: &[&str], environment: &[(&str, &str)]) -> (i32, Vec<Value>, String) {
    let mut command = Command::new(program());
    command.arg("verify").args(arguments).envs(environment.iter().copied());
    let output = command.output().expect("runs");
    parts(&output)
}

/// Exit code, lines of JSON, and standard error.
fn parts(output: &Output) -> (i32, Vec<Value>, String) {
    let lines = String::from_utf8(output.stdout.clone()).expect("UTF-8");
    let lines = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    (output.status.code().expect("it ended"), lines, String::from_utf8_lossy(&output.stderr).into_owned())
}

fn verdicts(lines: &[Value]) -> Vec<&str> {
    lines.iter().filter_map(|line| line["verdict"].as_str()).collect()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[tokio::test]
async fn a_folder_is_verified_whatever_is_broken_and_continued() {
    let (folder, key) = season().await;
    let root = text(folder.path());
    let (code, lines, said) = verify(&[root, "--json", "--jobs", "2", "--key", &key], &[]);
    assert_eq!((code, verdicts(&lines)), (1, vec!["verified", "refused", "verified"]), "{lines:?}\n{said}");
    assert_eq!(lines[1]["reason"], "truncated");
    let summary = &lines[3]["summary"];
    assert_eq!((&summary["replays"], &summary["verified"]), (&json!(3), &json!(2)), "{summary}");
    assert_eq!(summary["reasons"], json!({"truncated": 1}));
    assert!(said.contains("3 of 3 replays in") && said.contains("refused (truncated 1)"), "{said}");

    // The verified ones are skipped, the refused one is tried again. The last line of a killed program may be cut off.
    let earlier = folder.path().join("verdicts.jsonl");
    let mut written: String = lines.iter().map(|line| format!("{line}\n")).collect();
    written += "{\"file\": \"a.mc";
    std::fs::write(&earlier, written).expect("written");
    let (code, lines, _) = verify(&[root, "--json", "--resume", text(&earlier)], &[]);
    assert_eq!((code, verdicts(&lines)), (1, vec!["refused"]));
    assert_eq!(lines[1]["summary"]["skipped"], 2);
    std::fs::remove_file(folder.path().join("day2/cut.mcap")).expect("removed");
    let (code, lines, _) = verify(&[root, "--json", "--resume", text(&earlier)], &[]);
    assert_eq!((code, &lines[0]["summary"]["skipped"]), (0, &json!(2)));

    // Files alone: one object each, as ever. A missing one does not stop the next.
    let (missing, good) = (folder.path().join("none.mcap"), folder.path().join("a.mcap"));
    let (code, lines, _) = verify(&["--json", text(&missing), text(&good)], &[]);
    assert_eq!((code, verdicts(&lines), lines.len()), (1, vec!["unreadable", "verified"], 2));
    let empty = TempDir::new().expect("temporary directory");
    let (code, _, said) = verify(&[text(empty.path())], &[]);
    assert!(code == 1 && said.contains("there is no .mcap file in it"), "{said}");
}

#[tokio::test]
async fn an_interrupted_verification_says_what_was_done() {
    let (folder, _) = season().await;
    // Long enough to be interrupted.
    for copy in 0..3_000 {
        let to = folder.path().join(format!("day2/late/{copy:04}.mcap"));
        std::fs::hard_link(folder.path().join("a.mcap"), to).expect("linked");
    }
    let mut command = Command::new(program());
    command
        .args(["verify", "--json", "--jobs", "1"])
        .arg(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().expect("runs");
    let mut first = String::new();
    let mut out = std::io::BufReader::new(child.stdout.take().expect("piped"));
    std::io::BufRead::read_line(&mut out, &mut first).expect("a verdict");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(kill.success());
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut out, &mut rest).expect("reads");
    let output = child.wait_with_output().expect("ends");
    assert_eq!(output.status.code(), Some(130));
    let last: Value = serde_json::from_str(rest.lines().last().expect("a summary")).expect("JSON");
    let summary = &last["summary"];
    assert_eq!((&summary["interrupted"], &summary["replays"]), (&json!(true), &json!(3_003)), "{summary}");
    let done = rest.lines().count();
    assert_eq!(summary["done"], done, "{summary}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains(&format!("interrupted: {done} of 3003 replays")), "{said}");
}

#[tokio::test]
async fn a_bucket_is_verified_as_its_folder() {
    let Some(python) = python() else { return };
    let (folder, _) = season().await;
    let port = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a port").port();
    let mut bucket = moto(&python, port);
    let endpoint = format!("http://127.0.0.1:{port}");
    let environment = [
        ("AWS_ENDPOINT_URL", endpoint.as_str()),
        ("AWS_ACCESS_KEY_ID", "key"),
        ("AWS_SECRET_ACCESS_KEY", "secret"),
    ];
    // A page of a list has 1,000 keys: the last ones are on the second page.
    let fill =
        "import boto3, sys; from pathlib import Path; s3 = boto3.client('s3'); root = Path(sys.argv[1])
for path in root.rglob('*.mcap'):
    s3.put_object(Bucket='cup', Key=f'2026/replays x&/{path.relative_to(root)}', Body=path.read_bytes())
for k in range(1100):
    s3.put_object(Bucket='cup', Key=f'2026/hands/{k:04}.zip', Body=b'zip')
s3.put_object(Bucket='cup', Key='2025/old.mcap', Body=b'another season')";
    let mut command = Command::new(&python);
    command.args(["-c", fill, text(folder.path())]).envs(environment).env("AWS_DEFAULT_REGION", "us-east-1");
    assert!(command.status().expect("fills").success());
    let (code, lines, said) = verify(&["s3://cup/2026", "--json"], &environment);
    assert_eq!((code, verdicts(&lines)), (1, vec!["verified", "refused", "verified"]), "{lines:?}\n{said}");
    assert_eq!(lines[0]["file"], "s3://cup/2026/replays x&/a.mcap");
    let (code, _, said) = verify(&["s3://cup/2024"], &environment);
    assert!(code == 1 && said.contains("s3://cup/2024: there is no .mcap file in it"), "{said}");
    let (code, _, said) = verify(&["s3://none"], &environment);
    assert!(code == 1 && said.contains("NoSuchBucket"), "{said}");
    let _ = bucket.kill();
    let _ = bucket.wait();
}

/// Without Python, or without Ray, the reason is said.
#[tokio::test]
async fn a_missing_ray_is_said() {
    let folder = TempDir::new().expect("temporary directory");
    let file = folder.path().join("a.mcap");
    std::fs::write(&file, "no replay").expect("written");
    let (code, _, said) = verify(&["--ray", text(&file)], &[("PALMARES_PYTHON", "/nowhere/python")]);
    assert!(code == 1 && said.contains("/nowhere/python does not start: --ray needs a Python"), "{said}");
    let (code, _, said) = verify(&["--ray=host:1", text(&file)], &[("PALMARES_PYTHON", "false")]);
    assert!(code == 1 && said.contains("ended: --ray needs a Python with palmares[ray]"), "{said}");
}

/// Findings of the comparison with a table of runs.
fn differences(lines: &[Value]) -> Vec<(&str, &str)> {
    lines.iter().filter_map(|line| Some((line["run_id"].as_str()?, line["difference"].as_str()?))).collect()
}

#[tokio::test]
async fn a_folder_is_compared_with_the_table_of_runs() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut client, _) = cup.greet(&token).await;
    let mut runs = Vec::new();
    for ticks in [20, 30, 40] {
        assert_eq!(client.settled(official_reset()).await["op"], "obs");
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": ticks})).await;
        let result = client.ask(json!({"op": "stop"})).await;
        runs.push(result["run_id"].as_str().expect("an id").to_owned());
    }
    let data = cup.folder();
    let season = TempDir::new().expect("temporary directory");
    let (csv, json_file) = (season.path().join("runs.csv"), season.path().join("runs.json"));
    for (file, format) in [(&csv, "csv"), (&json_file, "json")] {
        let said = cup.admin(&["export", "runs", "--format", format, "-o", text(file)]);
        assert!(said.status.success(), "{said:?}");
    }
    let replays = season.path().join("replays");
    std::fs::create_dir(&replays).expect("folder");
    for run in &runs {
        let name = format!("{run}.mcap");
        std::fs::copy(data.join("replays").join(&name), replays.join(&name)).expect("copied");
    }
    let table = |file: &Path| {
        ["--json".to_owned(), text(&replays).to_owned(), "--runs".into(), text(file).to_owned()]
    };
    let compare = |file: &Path| {
        let arguments = table(file);
        verify(&arguments.iter().map(String::as_str).collect::<Vec<_>>(), &[])
    };
    // The data directory has its own table, and its server may run.
    for (code, lines, said) in [
        compare(&csv),
        compare(&json_file),
        verify(&["--json", text(&data)], &[]),
        verify(&["--json", text(&data.join("replays"))], &[]),
    ] {
        assert_eq!((code, differences(&lines)), (0, vec![]), "{lines:?}\n{said}");
        assert!(said.contains("compared with the runs in") && said.contains("0 differences"), "{said}");
    }

    // A replay is missing; one is a run of another table; a score and a file are not those of the table.
    std::fs::remove_file(replays.join(format!("{}.mcap", runs[0]))).expect("removed");
    let rows: Vec<Value> = serde_json::from_slice(&std::fs::read(&json_file).expect("reads")).expect("JSON");
    let mut other = rows.clone();
    other.retain(|row| row["run_id"] != runs[1].as_str());
    for row in other.iter_mut().filter(|row| row["run_id"] == runs[2].as_str()) {
        row["score"] = json!(77.0);
    }
    let forged = season.path().join("other.json");
    std::fs::write(&forged, json!(other).to_string()).expect("written");
    let (code, lines, said) = compare(&forged);
    let mut found = differences(&lines);
    found.sort_unstable();
    let mut expected =
        vec![(runs[0].as_str(), "missing"), (runs[1].as_str(), "unnamed"), (runs[2].as_str(), "differs")];
    expected.sort_unstable();
    assert_eq!((code, found), (1, expected), "{lines:?}\n{said}");
    assert!(said.contains("3 differences"), "{said}");

    // The same of the data directory itself.
    std::fs::remove_file(data.join("replays").join(format!("{}.mcap", runs[0]))).expect("removed");
    let (code, lines, _) = verify(&["--json", text(&data)], &[]);
    assert_eq!((code, differences(&lines)), (1, vec![(runs[0].as_str(), "missing")]), "{lines:?}");
    // Another file is refused.
    let (code, _, said) =
        verify(&["--json", text(&replays), "--runs", text(&replays.join(format!("{}.mcap", runs[1])))], &[]);
    assert!(code == 1 && said.contains("--runs"), "{said}");
}
