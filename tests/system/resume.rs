//! Lost connections and second sockets.

use crate::harness::{Client, Server, assert_error, get, reset, step};
use serde_json::{Value, json};
use std::time::Duration;

/// A connection that has resumed the session of `welcome`.
async fn resumed(server: &Server, welcome: &Value) -> (Client, Value) {
    let (client, back) = Client::resume(server, &welcome["resume_token"]).await;
    assert_eq!((&back["op"], &back["session_id"]), (&json!("welcome"), &welcome["session_id"]), "{back}");
    (client, back)
}

#[tokio::test]
async fn the_resume_token_replaces_the_connection_before() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "a").await;
    for tick in 0..3 {
        client.goes_on(tick).await;
        let (again, back) = resumed(&server, &welcome).await;
        assert_eq!((&back["run"]["tick"], &back["run"]["open"]), (&json!(tick + 1), &json!(true)), "{back}");
        assert_error(&client.next().await, "session_taken", true);
        assert_eq!(client.closed().await, (4409, "session_taken".to_owned()));
        client = again;
    }
    client.goes_on(3).await;
    // Without the token a second connection has a session of its own.
    let (_, own) = Client::greet(&server, "b").await;
    assert_ne!(own["session_id"], welcome["session_id"]);
    client.goes_on(4).await;
}

#[tokio::test]
async fn a_connection_that_cannot_send_is_replaced_too() {
    // The server would notice the dead connection after this time.
    let server = Server::start_with(&["--ping-timeout-s", "600"]);
    let (mut deaf, welcome) = Client::greet(&server, "deaf").await;
    let mut realtime = reset();
    realtime["mode"] = "realtime".into();
    let run = deaf.ask(realtime).await;
    // The client reads nothing: its observations fill both sockets, and the server waits until it can send again.
    tokio::time::sleep(Duration::from_secs(3)).await;
    let (mut again, back) = resumed(&server, &welcome).await;
    assert_eq!((&back["run"]["run_id"], &back["run"]["open"]), (&run["run_id"], &json!(true)), "{back}");
    let result = again.ask(json!({"op": "stop"})).await;
    assert!(result["dropped_obs"].as_u64() > Some(0), "the server could send all of them: {result}");
    drop(deaf);
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
async fn the_run_of_a_client_that_stays_away_is_scored_as_disconnected() {
    let server = Server::start_with(&["--resume-grace-s", "0"]);
    let (mut client, welcome) = Client::greet(&server, "gone").await;
    let obs = client.ask(reset()).await;
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
async fn an_unknown_token_opens_nothing() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    let hello = json!({"op": "hello", "client": "a", "resume_token": "0".repeat(32)});
    client.refused(hello, "session_over").await;
}
