//! Limits: size, rate, worlds.

use crate::harness::{Client, Server, assert_error, reset};
use serde_json::json;

/// A valid request of exactly `bytes` bytes: JSON allows white space at the end.
fn padded(bytes: usize) -> String {
    let request = r#"{"op":"time","id":5}"#;
    format!("{request}{}", " ".repeat(bytes - request.len()))
}

#[tokio::test]
async fn the_largest_message_is_answered() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "a").await;
    let limit = welcome["limits"]["message_bytes"].as_u64().expect("a number");
    assert_eq!(limit, 65536);
    client.send(&padded(65536)).await;
    assert_eq!(client.next().await["op"], "time");
    client.goes_on(0).await;
}

#[tokio::test]
async fn an_oversize_message_is_fatal_for_the_connection_but_not_for_the_run() {
    let server = Server::start();
    for bytes in [65537, 1 << 20] {
        let (mut client, welcome) = Client::playing(&server, "a").await;
        client.goes_on(0).await;
        client.send(&padded(bytes)).await;
        assert_error(&client.next().await, "too_large", true);
        assert_eq!(client.closed().await, (4413, "too_large".to_owned()));

        let (mut again, welcome_back) = Client::resume(&server, &welcome["resume_token"]).await;
        assert_eq!(welcome_back["session_id"], welcome["session_id"]);
        assert_eq!((&welcome_back["run"]["tick"], &welcome_back["run"]["open"]), (&json!(1), &json!(true)));
        again.goes_on(1).await;
    }
}

#[tokio::test]
async fn a_message_too_large_to_be_read_loses_the_connection_but_not_the_run() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "a").await;
    client.goes_on(0).await;
    // The server stops reading in the middle: whether the rest can be sent is up to the buffers between.
    client.try_send(&padded(8 << 20)).await;
    let (mut again, welcome_back) = Client::resume(&server, &welcome["resume_token"]).await;
    assert_eq!(welcome_back["run"]["tick"], 1, "{welcome_back}");
    again.goes_on(1).await;
}

#[tokio::test]
async fn a_full_server_refuses_another_world_and_takes_it_later() {
    let server = Server::start_with(&["--max-worlds", "1"]);
    let (mut first, _) = Client::playing(&server, "first").await;
    let (mut second, _) = Client::greet(&server, "second").await;
    let error = second.refused(reset(), "capacity").await;
    assert!(error["retry_after_s"].as_f64().is_some_and(|seconds| seconds > 0.0), "{error}");
    first.goes_on(0).await;
    assert_eq!(first.ask(json!({"op": "stop"})).await["op"], "result");
    // The place is free as soon as the world's thread has ended, which may be a moment later.
    let mut reply = second.ask(reset()).await;
    while reply["code"] == "capacity" {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
        reply = second.ask(reset()).await;
    }
    assert_eq!(reply["tick"], 0, "{reply}");
    second.goes_on(0).await;
}

#[tokio::test]
async fn a_client_with_too_many_requests_has_to_wait_and_may_go_on() {
    // One request per second and two at once: the third in a row comes too early on any machine.
    let server = Server::start_with(&["--max-requests-per-s", "1"]);
    let (mut client, _) = Client::greet(&server, "hasty").await;
    for id in 0..20 {
        client.send(&json!({"op": "time", "id": id}).to_string()).await;
    }
    let mut limited = None;
    for id in 0..20 {
        let reply = client.next().await;
        assert_eq!(reply["id"], id, "{reply}");
        if reply["op"] == "error" {
            assert_error(&reply, "rate_limited", false);
            limited = reply["retry_after_s"].as_f64();
        }
    }
    let wait_s = limited.expect("twenty requests at one per second are too many");
    assert!(wait_s > 0.0 && wait_s <= 1.0, "{wait_s}");
    let mut reply = client.ask(json!({"op": "time"})).await;
    while reply["code"] == "rate_limited" {
        tokio::time::sleep(std::time::Duration::from_millis(200)).await;
        reply = client.ask(json!({"op": "time"})).await;
    }
    assert_eq!(reply["op"], "time", "{reply}");
}
