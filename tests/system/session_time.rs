//! Sessions that request a limit.

use crate::harness::{Client, Server, get, reset, step};
use serde_json::{Value, json};

async fn limited(server: &Server, session_s: f64) -> Client {
    let mut client = Client::connect(server).await;
    let hello = json!({"op": "hello", "client": "timed", "session_s": session_s});
    let welcome = client.ask(hello).await;
    assert_eq!(welcome["session_left_s"], session_s, "{welcome}");
    client
}

/// Simulates until the session is over; returns the last observation.
async fn play_out(client: &mut Client) -> Value {
    let mut tick = 0;
    loop {
        let obs = client.ask(json!({"op": "step", "tick": tick, "action": {}, "repeat": 50})).await;
        if obs["op"] == "error" || obs["truncated"] == true {
            return obs;
        }
        tick = obs["tick"].as_u64().expect("a tick");
    }
}

#[tokio::test]
async fn a_spent_session_closes_the_run_and_keeps_its_result() {
    let server = Server::start();
    let mut client = limited(&server, 2.0).await;
    let opened = client.ask(reset()).await;
    let last = play_out(&mut client).await;
    // On a slow machine the wall clock may win, and then the step itself is refused.
    if last["op"] == "obs" {
        assert_eq!(
            (&last["reason"], &last["session_left_s"]),
            (&json!("session_over"), &json!(0.0)),
            "{last}"
        );
    } else {
        assert_eq!(last["code"], "session_over", "{last}");
    }
    client.refused(step(200), "session_over").await;
    client.refused(reset(), "session_over").await;
    let time = client.ask(json!({"op": "time"})).await;
    assert_eq!((&time["session_left_s"], &time["run"]["open"]), (&json!(0.0), &json!(false)), "{time}");

    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(
        (&result["reason"], &result["run_id"]),
        (&json!("session_over"), &opened["run_id"]),
        "{result}"
    );
    assert!(result["ticks"].as_u64().is_some_and(|ticks| ticks <= 200), "{result}");
    client.refused(json!({"op": "stop"}), "wrong_state").await;
    let run = get(&server, &format!("/v1/runs/{}", result["run_id"].as_str().expect("an id"))).json();
    assert_eq!((&run["status"], &run["score"]), (&json!("practice"), &result["score"]), "{run}");
}

#[tokio::test]
async fn the_time_is_spent_also_when_the_client_does_nothing() {
    let server = Server::start();
    let mut client = limited(&server, 0.5).await;
    let opened = client.ask(reset()).await;
    let path = format!("/v1/runs/{}", opened["run_id"].as_str().expect("an id"));
    let mut run = get(&server, &path).json();
    while run["status"] == "open" {
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        run = get(&server, &path).json();
    }
    assert_eq!(run["reason"], "session_over", "{run}");
    assert_eq!(client.ask(json!({"op": "stop"})).await["reason"], "session_over");
}

#[tokio::test]
async fn a_warning_comes_before_the_end() {
    let server = Server::start();
    let mut client = limited(&server, 11.0).await;
    assert_eq!(client.ask(reset()).await["op"], "obs");
    // 1.5 s of simulated time pass the mark at 10 s left.
    for tick in [0, 100] {
        let repeat = if tick == 0 { 100 } else { 50 };
        let request = json!({"op": "step", "id": 77, "tick": tick, "action": {}, "repeat": repeat});
        client.send(&request.to_string()).await;
    }
    let mut marks = Vec::new();
    let mut replies = 0;
    while replies < 2 {
        let message = client.next().await;
        if message["op"] == "warning" {
            assert!(message.get("id").is_none(), "{message}");
            marks.push(message["mark_s"].clone());
        } else {
            replies += 1;
        }
    }
    assert_eq!(marks, [json!(10)]);
}

#[tokio::test]
async fn practice_without_a_limit_has_no_end() {
    let server = Server::start();
    let (mut client, welcome) = Client::playing(&server, "free").await;
    assert_eq!(welcome["session_left_s"], Value::Null);
    client.goes_on(0).await;
    let time = client.ask(json!({"op": "time"})).await;
    assert_eq!((&time["session_left_s"], &time["simulated_s"]), (&Value::Null, &json!(0.01)), "{time}");
}
