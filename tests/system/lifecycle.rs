//! Starting and stopping the program.

use crate::harness::{Client, Server, get, program, request};
use serde_json::json;
use std::process::{Command, Output};
use tempfile::TempDir;

fn palmares(arguments: &[&str]) -> Output {
    Command::new(program())
        .args(arguments)
        .env_remove("DATABASE_URL")
        .env_remove("RUST_LOG")
        .output()
        .expect("palmares runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

async fn stopped_by(signal: &str) {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "open").await;
    client.goes_on(0).await;
    let (mut idle, _) = Client::greet(&server, "idle").await;
    let mut silent = Client::connect(&server).await;
    server.signal(signal);
    let result = client.next().await;
    assert_eq!((&result["op"], &result["reason"]), (&json!("result"), &json!("stopped")), "{result}");
    for client in [&mut client, &mut idle, &mut silent] {
        assert_eq!(client.closed().await, (1001, "server_shutdown".to_owned()));
    }
    let (status, log, folder) = server.wait();
    assert_eq!(status.code(), Some(0), "{log}");

    let server = Server::start_in(folder, &[]);
    let run = get(&server, &format!("/v1/runs/{}", result["run_id"].as_str().expect("an id"))).json();
    assert_eq!((&run["status"], &run["ticks"]), (&json!("practice"), &json!(1)), "{run}");
    assert_eq!(run["score"], result["score"]);
}

#[tokio::test]
async fn sigterm_scores_open_runs_and_exits_with_0() {
    stopped_by("TERM").await;
}

#[tokio::test]
async fn sigint_scores_open_runs_and_exits_with_0() {
    stopped_by("INT").await;
}

#[tokio::test]
async fn a_session_that_waits_for_its_client_is_scored_at_shutdown() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "away").await;
    let opened = client.ask(crate::harness::reset()).await;
    drop(client);
    server.signal("TERM");
    let (status, _, folder) = server.wait();
    assert!(status.success());
    let server = Server::start_in(folder, &[]);
    let run = get(&server, &format!("/v1/runs/{}", opened["run_id"].as_str().expect("an id"))).json();
    assert_eq!(run["status"], "practice", "{run}");
}

/// `palmares serve 2>&1 | tee log` and Ctrl-C: `tee` is gone first. Here every line that is written fails.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn a_server_whose_log_nobody_takes_goes_on_and_ends() {
    let server = Server::start_limited("exec 2>/dev/full");
    let (mut client, _) = Client::playing(&server, "unheard").await;
    client.goes_on(0).await;
    server.signal("TERM");
    assert_eq!(client.next().await["reason"], "stopped");
    let (status, ..) = server.wait();
    assert_eq!(status.code(), Some(0));
}

#[tokio::test]
async fn a_port_in_use_is_a_clear_error() {
    let server = Server::start();
    let folder = TempDir::new().expect("temporary directory");
    let data_dir = folder.path().join("new");
    let arguments = ["serve", "--listen", server.address(), "--data-dir", data_dir.to_str().expect("UTF-8")];
    let output = palmares(&arguments);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    let text = stderr(&output);
    assert!(text.contains(server.address()) && text.contains("in use"), "{text}");
    assert!(!data_dir.exists(), "a server that cannot listen leaves no trace");
    assert_eq!(get(&server, "/readyz").status, 200);
}

#[test]
fn a_data_directory_that_cannot_be_written_is_a_clear_error() {
    // A file in the way stops root as well; missing permissions do not.
    let folder = TempDir::new().expect("temporary directory");
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").expect("written");
    let data_dir = file.join("data");
    let output =
        palmares(&["serve", "--listen", "127.0.0.1:0", "--data-dir", data_dir.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(text.contains(data_dir.to_str().expect("UTF-8")) && text.contains("data directory"), "{text}");
}

#[tokio::test]
async fn two_servers_do_not_share_a_data_directory() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "first").await;
    let folder = server.database().parent().expect("a directory").to_owned();
    let output =
        palmares(&["serve", "--listen", "127.0.0.1:0", "--data-dir", folder.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("in use by another server"), "{}", stderr(&output));
    client.goes_on(0).await;
    assert_eq!(client.ask(json!({"op": "stop"})).await["op"], "result");
}

#[test]
fn a_database_this_version_cannot_use_is_a_clear_error() {
    let output = palmares(&["serve", "--listen", "127.0.0.1:0", "--database-url", "mysql://u:secret@h/d"]);
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(text.contains("sqlite://") && text.contains("postgres://"), "{text}");
    assert!(!text.contains("secret"), "{text}");
}

#[test]
fn the_help_names_what_there_is() {
    let text = |arguments: &[&str]| {
        let output = palmares(arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let help = text(&["--help"]);
    for command in ["serve", "hands", "tasks"] {
        assert!(help.contains(command), "{help}");
    }
    let help = text(&["serve", "--help"]);
    for option in ["--listen", "--data-dir", "--database-url", "--max-worlds"] {
        assert!(help.contains(option), "{help}");
    }
    assert!(text(&["hands"]).contains("softhand"));
    assert!(text(&["tasks"]).contains("balls"));
    assert!(text(&["--version"]).starts_with("palmares "));
}

#[test]
fn what_is_not_there_is_a_problem() {
    let server = Server::start();
    get(&server, "/v1/nothing").assert_problem(404, "not_found");
    get(&server, "/v1/runs/run_0").assert_problem(404, "not_found");
    get(&server, "/v1/hands/hook").assert_problem(404, "unknown_hand");
    request(&server, "POST", "/v1/leaderboard").assert_problem(405, "bad_request");
    assert_eq!(get(&server, "/healthz").status, 200);
    assert_eq!(get(&server, "/readyz").status, 200);
}

#[test]
fn a_hand_is_described_in_full() {
    let server = Server::start();
    let hand = get(&server, "/v1/hands/softhand").json();
    assert_eq!(hand["name"], "softhand");
    let listed = get(&server, "/v1/hands").json()["hands"][0].clone();
    let names = |list: &serde_json::Value| -> Vec<_> {
        list.as_array().expect("a list").iter().map(|entry| entry["name"].clone()).collect()
    };
    assert_eq!(listed["motors"], json!(names(&hand["motors"])));
    assert_eq!(listed["joints"], json!(names(&hand["coordinates"])));
}
