//! Worlds that fail: everybody who hears of it hears of what, when, and what to try.

use crate::harness::{Client, Server, get};
use crate::impossible::{hand_of_a_billion, no_limits};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Of the worlds that fail here; those of the program itself are not among them.
const CODES: [&str; 4] = ["not_finite", "out_of_bounds", "unsolvable", "work_exhausted"];

/// A folder with a hand that no world can compute, and a file with limits that let it in.
fn impossible() -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().expect("temporary directory");
    let (archive, limits) = (folder.path().join("billion.zip"), folder.path().join("limits.toml"));
    std::fs::write(&archive, hand_of_a_billion()).expect("written");
    std::fs::write(&limits, no_limits()).expect("written");
    (folder, archive, limits)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn word(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("a text, not {value}"))
}

/// The value of a field in a line of the log.
fn field<'a>(line: &'a str, name: &str) -> &'a str {
    let rest = line.split_once(&format!(" {name}=")).unwrap_or_else(|| panic!("no {name} in {line}")).1;
    rest.split(' ').next().unwrap_or_default().trim_matches('"')
}

#[tokio::test]
async fn a_failed_world_is_told_to_its_team_to_spectators_and_in_the_log() {
    let (_folder, archive, limits) = impossible();
    let server = Server::start_with(&["--config", text(&limits), "--hand", text(&archive)]);
    let (mut client, _) = Client::greet(&server, "billion").await;
    let opened = client.ask(json!({"op": "reset", "task": "grasp", "hand": "billion", "seed": 5})).await;
    assert_eq!(opened["op"], "obs", "{opened}");
    let mut viewer = Client::connect_to(&server, "/v1/watch").await;
    viewer.ask(json!({"op": "subscribe", "featured": true})).await;
    let (mut tick, mut reply) = (0, opened.clone());
    while reply["op"] == "obs" {
        assert!(tick < 500, "this world was computed");
        let action = json!({"hand": [tick % 2, tick % 2]});
        reply = client.ask(json!({"op": "step", "tick": tick, "action": action})).await;
        tick += 1;
    }
    assert_eq!(
        (&reply["op"], &reply["code"], &reply["fatal"]),
        (&json!("error"), &json!("internal"), &json!(false))
    );
    let (fault, message) = (word(&reply["fault"]).to_owned(), word(&reply["message"]));
    assert!(CODES.contains(&fault.as_str()), "{reply}");
    let begins = format!("the world failed ({fault}) in tick {tick}, step ");
    assert!(message.starts_with(&begins), "{message}");
    for part in ["; ", "try ", "is void; reset opens another"] {
        assert!(message.contains(part), "'{part}' is not in {message}");
    }

    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["reason"], &result["status"]), (&json!("world_fault"), &json!("voided")), "{result}");
    assert_eq!(word(&result["fault"]), fault);
    assert!(word(&result["note"]).starts_with(&begins), "{result}");
    let run_id = word(&result["run_id"]);
    let stored = get(&server, &format!("/v1/runs/{run_id}")).json();
    assert_eq!((&stored["note"], &stored["reason"]), (&result["note"], &json!("world_fault")), "{stored}");
    loop {
        let told = viewer.next().await;
        if told["op"] == "ended" {
            assert_eq!((&told["outcome"], word(&told["fault"])), (&Value::Null, fault.as_str()), "{told}");
            break;
        }
    }

    // Another run goes on, and its result says nothing of a fault.
    assert_eq!(
        client.ask(json!({"op": "reset", "task": "grasp", "hand": "pinch", "seed": 5})).await["op"],
        "obs"
    );
    let sound = client.ask(json!({"op": "stop"})).await;
    assert!(sound.get("fault").is_none() && sound.get("note").is_none(), "{sound}");

    let run_id = run_id.to_owned();
    server.signal("TERM");
    let (_, log, _) = server.wait();
    let line = log.lines().find(|line| line.contains("world fault")).unwrap_or_else(|| panic!("{log}"));
    let told = ["run", "fault", "tick", "task", "hand", "seed"].map(|name| field(line, name));
    let tick = tick.to_string();
    assert_eq!(told, [run_id.as_str(), fault.as_str(), tick.as_str(), "grasp", "billion", "5"], "{line}");
    let step: u64 = field(line, "step").parse().expect("a number");
    assert!(step <= 10 * tick.parse::<u64>().expect("a number"), "{line}");
    assert!(line.contains("why=") && line.contains("try "), "{line}");
}

#[tokio::test]
async fn the_stream_of_a_failed_world_ends_and_says_why() {
    let (_folder, archive, limits) = impossible();
    let server = Server::start_with(&["--config", text(&limits), "--hand", text(&archive)]);
    let (mut client, _) = Client::greet(&server, "billion").await;
    let request = json!({"op": "reset", "task": "grasp", "hand": "billion", "seed": 1, "mode": "realtime"});
    assert_eq!(client.ask(request).await["op"], "obs");
    let mut last = client.streamed().await;
    let mut id = 1_000;
    while last["truncated"] == false {
        // Answers are not waited for: the last observation may come before one.
        id += 1;
        let k = last["tick"].as_u64().expect("a tick") % 2;
        client.send(&json!({"op": "act", "id": id, "action": {"hand": [k, k]}}).to_string()).await;
        last = client.streamed().await;
    }
    assert_eq!(last["reason"], "world_fault", "{last}");
    let result = client.settled(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["reason"]), (&json!("result"), &json!("world_fault")), "{result}");
    assert!(CODES.contains(&word(&result["fault"])), "{result}");
    assert!(word(&result["note"]).contains("; "), "{result}");
}
