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

/// Sends a request whose reply is lost, then resumes the session and sends it again. Returns the reply, and the tick of the welcome.
async fn missed(
    server: &Server,
    mut client: Client,
    token: &Value,
    request: &Value,
) -> (Client, Value, Value) {
    client.send(&request.to_string()).await;
    // The reply may be on its way or not: the connection is cut in both cases.
    drop(client);
    let (mut again, back) = Client::resume(server, token).await;
    again.send(&request.to_string()).await;
    let reply = again.next().await;
    (again, reply, back)
}

#[tokio::test]
async fn a_request_whose_reply_was_lost_is_carried_out_once() {
    let server = Server::start();
    let (mut undisturbed, _) = Client::greet(&server, "b").await;
    let (client, welcome) = Client::greet(&server, "a").await;
    let token = &welcome["resume_token"];
    let reset = json!({"op": "reset", "id": 70, "task": "balls", "hand": "softhand", "seed": 3});
    undisturbed.ask(reset.clone()).await;
    let (mut client, opened, _) = missed(&server, client, token, &reset).await;
    assert_eq!(
        (&opened["op"], &opened["tick"], &opened["id"]),
        (&json!("obs"), &json!(0), &json!(70)),
        "{opened}"
    );
    assert!(opened["scene"]["bodies"].is_array(), "{opened}");
    for k in 0..12_u64 {
        let action = json!({"hand": [0.05 * k as f64]});
        let step = json!({"op": "step", "id": 100 + k, "tick": 4 * k, "repeat": 4, "action": action});
        let wanted = undisturbed.ask(step.clone()).await;
        let (again, found, back) = missed(&server, client, token, &step).await;
        client = again;
        assert_eq!(back["run"]["run_id"], opened["run_id"], "{back}");
        for field in ["tick", "hand", "truth", "events", "score", "applied_action"] {
            assert_eq!(found[field], wanted[field], "{field} of step {k}: {found}");
        }
    }
    let stop = json!({"op": "stop", "id": 200});
    let wanted = undisturbed.ask(stop.clone()).await;
    let (mut client, result, _) = missed(&server, client, token, &stop).await;
    for field in ["op", "ticks", "score", "state_hash"] {
        assert_eq!(result[field], wanted[field], "{result}");
    }
    assert_eq!((&result["ticks"], &result["run_id"]), (&json!(48), &opened["run_id"]), "{result}");
    client.refused(json!({"op": "stop"}), "wrong_state").await;
}

#[tokio::test]
async fn a_request_with_another_id_or_content_is_another_request_also_after_a_resume() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "a").await;
    let step = json!({"op": "step", "id": 50, "tick": 0, "action": {"hand": [0.5]}});
    client.send(&step.to_string()).await;
    assert_eq!(client.next().await["tick"], 1);
    // On the same connection it is stale, as it always was.
    client.send(&step.to_string()).await;
    assert_error(&client.next().await, "stale_tick", false);
    let (mut client, _) = resumed(&server, &welcome).await;
    for (id, sigma) in [(51, 0.5), (50, 0.6)] {
        let other = json!({"op": "step", "id": id, "tick": 0, "action": {"hand": [sigma]}});
        client.send(&other.to_string()).await;
        assert_error(&client.next().await, "stale_tick", false);
    }
    for _ in 0..2 {
        client.send(&step.to_string()).await;
        assert_eq!(client.next().await["tick"], 1);
    }
    client.goes_on(1).await;
    client.send(&step.to_string()).await;
    assert_error(&client.next().await, "stale_tick", false);
}

#[tokio::test]
async fn a_push_whose_reply_was_lost_pushes_once() {
    let server = Server::start();
    let (client, welcome) = Client::playing(&server, "a").await;
    let (mut undisturbed, _) = Client::playing(&server, "b").await;
    let push = json!({"op": "perturb", "id": 60, "link": "base", "wrench": {"force": [0, 0, 20]}, "duration_s": 0.1});
    undisturbed.ask(push.clone()).await;
    let token = &welcome["resume_token"];
    let (first, ack, _) = missed(&server, client, token, &push).await;
    assert_eq!((&ack["op"], &ack["tick"]), (&json!("ack"), &json!(1)), "{ack}");
    // It is not sent once more on that connection: whoever has a reply there and asks again wants another push.
    drop(first);
    let (mut client, _) = Client::resume(&server, token).await;
    client.send(&push.to_string()).await;
    let ack = client.next().await;
    assert_eq!((&ack["op"], &ack["tick"]), (&json!("ack"), &json!(1)), "{ack}");
    for tick in 0..20 {
        let (found, wanted) = (client.ask(step(tick)).await, undisturbed.ask(step(tick)).await);
        assert_eq!(found["hand"], wanted["hand"], "tick {tick}");
    }
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
