//! Clients that fall silent, and clients that do not listen.

use crate::harness::{Client, Server, reset};
use serde_json::json;
use std::time::Duration;

fn realtime() -> serde_json::Value {
    let mut request = reset();
    request["mode"] = "realtime".into();
    request
}

#[tokio::test]
async fn who_gives_no_sign_of_life_is_dropped_and_may_come_back() {
    let server = Server::start_with(&["--ping-timeout-s", "1"]);
    let (client, welcome) = Client::playing(&server, "silent").await;
    assert_eq!(welcome["limits"]["ping_timeout_s"], 1.0);
    // A client that is not polled answers no pings, but its socket stays open: the server must drop it.
    let (mut again, back) = Client::resume(&server, &welcome["resume_token"]).await;
    assert_eq!((&back["session_id"], &back["run"]["tick"]), (&welcome["session_id"], &json!(0)), "{back}");
    again.goes_on(0).await;
    drop(client);
}

#[tokio::test]
async fn who_answers_pings_stays() {
    let server = Server::start_with(&["--ping-timeout-s", "1"]);
    let (mut client, _) = Client::playing(&server, "patient").await;
    client.listen_for(Duration::from_secs(3)).await;
    client.goes_on(0).await;
}

#[tokio::test]
async fn who_does_not_take_what_is_streamed_is_dropped_and_its_world_goes_on() {
    let server = Server::start_with(&["--ping-timeout-s", "2"]);
    let (mut deaf, welcome) = Client::greet(&server, "deaf").await;
    deaf.ask(realtime()).await;
    // The client reads nothing any more; after it returns, its world is well ahead of its last observation.
    tokio::time::sleep(Duration::from_secs(1)).await;
    let (mut again, back) = Client::resume(&server, &welcome["resume_token"]).await;
    assert_eq!(back["session_id"], welcome["session_id"], "{back}");
    let tick = back["run"]["tick"].as_u64().expect("a tick");
    assert!(tick > 1, "{back}");
    assert!(again.streamed().await["tick"].as_u64().is_some_and(|seen| seen + 1 >= tick));
    drop(deaf);
}
