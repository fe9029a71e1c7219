//! Lost connections and second sockets.

use crate::harness::{Client, Server, get, step};
use serde_json::json;
use std::time::Duration;

#[tokio::test]
async fn a_second_socket_for_a_session_is_refused_and_the_first_goes_on() {
    let server = Server::start();
    let (mut first, welcome) = Client::playing(&server, "a").await;
    let mut second = Client::connect(&server).await;
    let hello = json!({"op": "hello", "client": "b", "resume_token": welcome["resume_token"]});
    for tick in 0..2 {
        second.refused(hello.clone(), "session_taken").await;
        first.goes_on(tick).await;
    }
    // It may have a session of its own, on the same connection.
    let own = second.ask(json!({"op": "hello", "client": "b"})).await;
    assert_ne!(own["session_id"], welcome["session_id"]);
}

#[tokio::test]
async fn a_lost_connection_leaves_the_run_waiting() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "a").await;
    let mut token = welcome["resume_token"].clone();
    for tick in 0..3 {
        client.goes_on(tick).await;
        drop(client);
        let (again, back) = Client::resume(&server, &token).await;
        assert_eq!(back["session_id"], welcome["session_id"], "{back}");
        assert_eq!(back["team"], "a", "{back}");
        assert_eq!(back["run"]["tick"], tick + 1, "{back}");
        token = back["resume_token"].clone();
        client = again;
    }
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["ticks"], &result["reason"]), (&json!(3), &json!("stopped")), "{result}");
}

#[tokio::test]
async fn who_does_not_come_back_is_scored_as_disconnected() {
    let server = Server::start_with(&["--resume-grace-s", "0"]);
    let (mut client, welcome) = Client::greet(&server, "gone").await;
    let obs = client.ask(crate::harness::reset()).await;
    client.goes_on(0).await;
    drop(client);
    let path = format!("/v1/runs/{}", obs["run_id"].as_str().expect("an id"));
    let mut run = get(&server, &path).json();
    while run["status"] == "open" {
        tokio::time::sleep(Duration::from_millis(50)).await;
        run = get(&server, &path).json();
    }
    assert_eq!((&run["status"], &run["reason"]), (&json!("practice"), &json!("disconnected")), "{run}");
    assert_eq!(run["ticks"], 1, "{run}");

    let (mut late, reply) = Client::resume(&server, &welcome["resume_token"]).await;
    assert_eq!(reply["code"], "session_over", "{reply}");
    assert_eq!(reply["fatal"], false, "{reply}");
    late.refused(step(1), "wrong_state").await;
    assert_eq!(late.ask(json!({"op": "hello", "client": "gone"})).await["op"], "welcome");
}

#[tokio::test]
async fn a_token_that_never_was_opens_nothing() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    let hello = json!({"op": "hello", "client": "a", "resume_token": "0".repeat(32)});
    client.refused(hello, "session_over").await;
}
