//! Clients that fall silent, and clients that read nothing.

use crate::harness::{Client, Server, get, reset};
use serde_json::Value;
use std::time::Duration;

fn realtime() -> Value {
    let mut request = reset();
    request["mode"] = "realtime".into();
    request
}

/// Waits until the server has ended a run; returns it.
async fn ended(server: &Server, run_id: &Value) -> Value {
    let path = format!("/v1/runs/{}", run_id.as_str().expect("an id"));
    let mut run = get(server, &path).json();
    while run["status"] == "open" {
        tokio::time::sleep(Duration::from_millis(50)).await;
        run = get(server, &path).json();
    }
    run
}

#[tokio::test]
async fn a_client_that_answers_no_pings_is_dropped() {
    let server = Server::start_with(&["--ping-timeout-s", "1", "--resume-grace-s", "0"]);
    let (mut client, welcome) = Client::greet(&server, "silent").await;
    assert_eq!(welcome["limits"]["ping_timeout_s"], 1.0);
    let run_id = client.ask(reset()).await["run_id"].clone();
    // A client that is not polled answers no pings, but its socket stays open: the server must drop it.
    assert_eq!(ended(&server, &run_id).await["reason"], "disconnected");
    drop(client);
}

#[tokio::test]
async fn a_client_that_answers_pings_stays() {
    let server = Server::start_with(&["--ping-timeout-s", "1"]);
    let (mut client, _) = Client::playing(&server, "patient").await;
    client.listen_for(Duration::from_secs(3)).await;
    client.goes_on(0).await;
}

#[tokio::test]
async fn a_client_that_reads_no_observations_is_dropped_and_its_world_goes_on() {
    let server = Server::start_with(&["--ping-timeout-s", "1", "--resume-grace-s", "1"]);
    let (mut deaf, _) = Client::greet(&server, "deaf").await;
    let run_id = deaf.ask(realtime()).await["run_id"].clone();
    let run = ended(&server, &run_id).await;
    assert_eq!(run["reason"], "disconnected", "{run}");
    // It ticked until the connection was dropped, and while its session waited.
    assert!(run["ticks"].as_u64() > Some(100), "{run}");
    drop(deaf);
}
