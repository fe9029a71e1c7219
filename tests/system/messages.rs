//! A snapshot of every message on the wire: a change that a client could notice shows up in review.

use crate::harness::{Client, Server, get, reset, step};
use serde_json::{Value, json};

/// Numbers that the protocol or the rules determine.
const RULED: [&str; 6] = ["minimum", "maximum", "requests_burst", "score", "total", "mark_s"];

/// Values that differ from run to run, or belong to physics rather than to the protocol, become their kind.
fn redacted(mut value: Value) -> Value {
    redact("", &mut value);
    value
}

fn redact(key: &str, value: &mut Value) {
    match key {
        "session_id" | "resume_token" | "run_id" | "build_hash" | "server_version" | "version"
        | "state_hash" | "seed_hex" | "server_unix_ms" | "unix_ms" | "started_unix_ms" | "ended_unix_ms"
        | "reached_unix_ms" | "wall_s" | "elapsed_s" | "sha256" | "replay_sha256" | "replay_key"
        | "bytes" => *value = json!(format!("<{key}>")),
        // The solver's tests check their number and content.
        "joints" | "predicted_equilibrium" if value.is_array() => *value = json!(format!("<{key}>")),
        "contacts" => {
            for (list, entries) in value.as_object_mut().into_iter().flatten() {
                *entries = json!(format!("<{list}>"));
            }
        }
        _ => match value {
            Value::Number(number) if number.is_f64() && !RULED.contains(&key) && !key.ends_with("_s") => {
                *value = json!("<number>");
            }
            Value::Array(entries) => {
                let numbers = !entries.is_empty() && entries.iter().all(Value::is_number);
                let table = !entries.is_empty() && entries.iter().all(Value::is_array);
                let bodies = table || matches!(key, "bodies" | "parts");
                if numbers && key != "shape" {
                    *value = json!(format!("<{} numbers>", entries.len()));
                } else if bodies {
                    // One entry represents all.
                    entries.truncate(1);
                    entries.iter_mut().for_each(|entry| redact(key, entry));
                } else {
                    entries.iter_mut().for_each(|entry| redact(key, entry));
                }
            }
            Value::Object(fields) => fields.iter_mut().for_each(|(key, value)| redact(key, value)),
            _ => {}
        },
    }
}

fn snapshot(name: &str, value: Value) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_sort_maps(true);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_json_snapshot!(name, redacted(value)));
}

#[tokio::test]
async fn every_message_is_as_it_was() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    let hello = json!({"op": "hello", "client": {"name": "golden", "version": "1"}, "session_s": 600});
    snapshot("welcome", client.ask(hello).await);
    let mut request = reset();
    request["sensing"] = json!("truth");
    snapshot("obs_reset", without_left(client.ask(request).await));
    let obs = client.ask(json!({"op": "step", "tick": 0, "action": {"hand": [0.25]}, "repeat": 2})).await;
    snapshot("obs_step", without_left(obs));
    snapshot("error", client.ask(step(0)).await);
    client.send("{").await;
    snapshot("error_without_id", client.next().await);
    snapshot("time", without_left(client.ask(json!({"op": "time"})).await));
    let result = client.ask(json!({"op": "stop"})).await;
    let run_id = result["run_id"].as_str().expect("an id").to_owned();
    snapshot("result", without_left(result));
    snapshot("rest_run", get(&server, &format!("/v1/runs/{run_id}")).json());
    snapshot("rest_leaderboard", get(&server, "/v1/leaderboard").json());
    snapshot("rest_competition", get(&server, "/v1/competition").json());
    snapshot("rest_tasks", get(&server, "/v1/tasks").json());
    snapshot("rest_hands", get(&server, "/v1/hands").json());
    snapshot("problem", get(&server, "/v1/hands/hook").json());
}

#[tokio::test]
async fn a_warning_is_as_it_was() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    client.ask(json!({"op": "hello", "client": "golden", "session_s": 10.5})).await;
    client.ask(reset()).await;
    client.send(&json!({"op": "step", "id": 1, "tick": 0, "action": {}, "repeat": 60}).to_string()).await;
    snapshot("warning", without_left(client.next().await));
}

#[tokio::test]
async fn with_sensors_only_there_is_no_truth() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "blind").await;
    let mut request = reset();
    request["sensing"] = json!("sensors");
    assert!(client.ask(request).await.get("truth").is_none());
    let obs = client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 3})).await;
    assert!(obs.get("truth").is_none() && obs.get("scene").is_none(), "{obs}");
    snapshot("obs_sensors", obs);
}

#[tokio::test]
async fn the_same_seed_and_actions_give_the_same_run() {
    let server = Server::start();
    let mut results = Vec::new();
    for repeat in [1, 4] {
        let (mut client, _) = Client::playing(&server, "twin").await;
        for tick in (0..4).step_by(repeat) {
            let action = json!({"base": {"linear": [0.1, 0, 0], "angular": [0, 0, 0]}, "hand": [0.5]});
            client.ask(json!({"op": "step", "tick": tick, "action": action, "repeat": repeat})).await;
        }
        results.push(client.ask(json!({"op": "stop"})).await["state_hash"].clone());
    }
    assert!(results[0].is_string());
    assert_eq!(results[0], results[1]);
}

/// The clock's reading changes while the test runs.
fn without_left(mut message: Value) -> Value {
    message["session_left_s"] = json!("<session_left_s>");
    message
}
