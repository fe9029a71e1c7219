//! Requests that are malformed or come at the wrong time: refused, and the run continues.

use crate::harness::{Client, Server, assert_error, reset, step};
use serde_json::json;
use tokio_tungstenite::tungstenite::Message;

#[tokio::test]
async fn broken_json() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    for (tick, text) in
        ["", "{", "hello", "{\"op\":\"time\",\"id\":1}}", "\u{feff}{}"].into_iter().enumerate()
    {
        client.send(text).await;
        let error = client.next().await;
        assert_error(&error, "bad_json", false);
        assert!(error.get("id").is_none(), "{error}");
        client.goes_on(tick as u64).await;
    }
}

#[tokio::test]
async fn a_binary_frame_is_bad_json() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    client.send_message(Message::binary(br#"{"op":"time","id":1}"#.to_vec())).await;
    assert_error(&client.next().await, "bad_json", false);
    client.goes_on(0).await;
}

#[tokio::test]
async fn unknown_op() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    client.refused(json!({"op": "fly"}), "unknown_op").await;
    client.goes_on(0).await;
}

#[tokio::test]
async fn bad_request_names_the_field() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    let cases = [
        (json!({"op": 3}), "op"),
        (json!({"tick": 3}), "op"),
        (json!({"op": "step", "action": {}}), "`tick`"),
        (json!({"op": "step", "tick": -1, "action": {}}), "tick: "),
        (json!({"op": "step", "tick": 0.5, "action": {}}), "tick: "),
        // A whole number, but written as a float.
        (json!({"op": "step", "tick": 5.0, "action": {}}), "tick: "),
        (json!({"op": "step", "tick": 6}), "action: missing"),
        (json!({"op": "step", "tick": 0, "action": {}, "speed": 2}), "`speed`"),
        (json!({"op": "stop", "now": true}), "`now`"),
        (json!({"op": "reset", "task": "balls", "hand": "softhand", "mode": "fast"}), "mode: "),
        (json!({"op": "reset", "task": "balls", "hand": "softhand", "mode": "slow"}), "lockstep"),
        (json!({"op": "reset", "task": "balls", "hand": "softhand", "seed": -1}), "seed: "),
        (json!({"op": "reset", "task": "balls"}), "`hand`"),
        (json!({"op": "act"}), "action: missing"),
        (json!({"op": "perturb"}), "link"),
    ];
    for (tick, (request, named)) in cases.into_iter().enumerate() {
        let error = client.refused(request, "bad_request").await;
        assert!(error["message"].as_str().is_some_and(|text| text.contains(named)), "{named}: {error}");
        client.goes_on(tick as u64).await;
    }
}

#[tokio::test]
async fn repeat_outside_its_limits_is_a_bad_request() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "a").await;
    let most = welcome["limits"]["repeat"].as_u64().expect("a number");
    for repeat in [0, most + 1] {
        client.refused(json!({"op": "step", "tick": 0, "action": {}, "repeat": repeat}), "bad_request").await;
    }
    let obs = client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": most})).await;
    assert_eq!(obs["tick"], most, "{obs}");
    client.goes_on(most).await;
}

#[tokio::test]
async fn a_request_without_a_usable_id_is_a_bad_request() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    for (tick, id) in ["-1", "1.5", "1.0", "1e0", "\"x\"", "null", "9007199254740992"].into_iter().enumerate()
    {
        client.send(&format!(r#"{{"op":"time","id":{id}}}"#)).await;
        let error = client.next().await;
        assert_error(&error, "bad_request", false);
        assert!(error.get("id").is_none(), "{error}");
        client.goes_on(tick as u64).await;
    }
}

#[tokio::test]
async fn nothing_before_hello_and_hello_once() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    for request in [reset(), step(0), json!({"op": "stop"}), json!({"op": "time"})] {
        client.refused(request, "wrong_state").await;
    }
    client.refused(json!({"op": "hello", "client": {"name": ""}}), "bad_request").await;
    client.refused(json!({"op": "hello", "client": {"name": "a"}, "session_s": 0}), "bad_request").await;
    assert_eq!(client.ask(json!({"op": "hello", "client": "a/1"})).await["op"], "welcome");
    client.refused(json!({"op": "hello", "client": "a/1"}), "wrong_state").await;
    assert_eq!(client.ask(reset()).await["op"], "obs");
    client.goes_on(0).await;
}

#[tokio::test]
async fn a_run_is_opened_stepped_and_stopped_in_that_order() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "a").await;
    client.refused(step(0), "wrong_state").await;
    client.refused(json!({"op": "stop"}), "wrong_state").await;
    assert_eq!(client.ask(reset()).await["tick"], 0);
    client.goes_on(0).await;
    client.refused(reset(), "wrong_state").await;
    client.goes_on(1).await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["ticks"]), (&json!("result"), &json!(2)), "{result}");
    client.refused(json!({"op": "stop"}), "wrong_state").await;
    client.refused(step(2), "wrong_state").await;
    assert_eq!(client.ask(reset()).await["tick"], 0, "the next run begins at tick 0");
    client.goes_on(0).await;
}

#[tokio::test]
async fn a_stale_tick_is_refused() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    client.goes_on(0).await;
    for tick in [0, 2, u64::MAX] {
        client.refused(step(tick), "stale_tick").await;
    }
    client.goes_on(1).await;
}

#[tokio::test]
async fn unknown_task_and_hand_are_refused_and_named() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "a").await;
    let error =
        client.refused(json!({"op": "reset", "task": "juggle", "hand": "softhand"}), "unknown_task").await;
    assert!(error["message"].as_str().is_some_and(|text| text.contains("balls")), "{error}");
    let error = client.refused(json!({"op": "reset", "task": "balls", "hand": "hook"}), "unknown_hand").await;
    assert!(error["message"].as_str().is_some_and(|text| text.contains("softhand")), "{error}");
    assert_eq!(client.ask(reset()).await["tick"], 0);
    client.goes_on(0).await;
}

#[tokio::test]
async fn replies_come_in_order_when_requests_are_not_waited_for() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    for tick in 0..20_u64 {
        client.send(&json!({"op": "step", "id": 100 + tick, "tick": tick, "action": {}}).to_string()).await;
    }
    for tick in 0..20_u64 {
        let obs = client.next().await;
        assert_eq!((&obs["id"], &obs["tick"]), (&json!(100 + tick), &json!(tick + 1)), "{obs}");
    }
}

#[tokio::test]
async fn bye_scores_the_open_run_and_closes_with_1000() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "polite").await;
    client.goes_on(0).await;
    client.send(r#"{"op":"bye","id":9}"#).await;
    assert_eq!(client.closed().await.0, 1000);
    let rows = crate::harness::get(&server, "/v1/leaderboard").json();
    assert_eq!((&rows["rows"][0]["team"], &rows["rows"][0]["runs"]), (&json!("polite"), &json!(1)), "{rows}");
}
