//! Runs that follow the clock.

use crate::harness::{Client, Server, get, reset, step};
use serde_json::{Value, json};
use std::time::{Duration, Instant};

fn realtime() -> Value {
    let mut request = reset();
    request["mode"] = "realtime".into();
    request
}

/// A connection with an open realtime run; the welcome; the first observation.
async fn playing(server: &Server, team: &str) -> (Client, Value, Value) {
    let (mut client, welcome) = Client::greet(server, team).await;
    let obs = client.ask(realtime()).await;
    assert_eq!((&obs["tick"], &obs["run"]["mode"]), (&json!(0), &json!("realtime")), "{obs}");
    (client, welcome, obs)
}

fn act(hand: f64) -> Value {
    json!({"op": "act", "action": {"hand": [hand]}})
}

fn tick_of(message: &Value) -> u64 {
    message["tick"].as_u64().expect("a tick")
}

#[tokio::test]
async fn the_world_streams_every_tick_and_never_runs_ahead_of_the_clock() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "clock").await;
    let start = Instant::now();
    client.ask(realtime()).await;
    let (mut last, mut skipped) = (0, 0);
    while last < 30 {
        let obs = client.streamed().await;
        let tick = tick_of(&obs);
        assert!(tick > last, "{obs}");
        skipped += tick - last - 1;
        last = tick;
        assert!(obs.get("id").is_none(), "{obs}");
        assert!(obs["late_s"].as_f64().is_some_and(|late_s| late_s >= 0.0), "{obs}");
        assert!(start.elapsed() >= Duration::from_millis(10 * tick), "tick {tick} came early");
    }
    let result = client.ask(json!({"op": "stop"})).await;
    let ticks = result["ticks"].as_u64().expect("a number");
    assert!(ticks >= 30, "{result}");
    assert!(result["dropped_obs"].as_u64().is_some_and(|dropped| dropped >= skipped), "{result}");
    assert_eq!(
        (&result["mode"], &result["missed_ticks"]),
        (&json!("realtime"), &result["ticks"]),
        "{result}"
    );
    let run = get(&server, &format!("/v1/runs/{}", result["run_id"].as_str().expect("an id"))).json();
    assert_eq!((&run["mode"], &run["missed_ticks"]), (&json!("realtime"), &result["ticks"]), "{run}");
}

#[tokio::test]
async fn an_action_takes_effect_at_the_tick_that_was_acknowledged() {
    let server = Server::start();
    let (mut client, _, _) = playing(&server, "a").await;
    for sigma in [0.25, 0.5] {
        let ack = client.ask(act(sigma)).await;
        assert_eq!(ack["op"], "ack", "{ack}");
        let tick = tick_of(&ack);
        loop {
            let obs = client.streamed().await;
            let applied = obs["applied_action"]["hand"][0].as_f64().expect("a number");
            assert_eq!(applied == sigma, tick_of(&obs) >= tick, "{obs} after {ack}");
            if tick_of(&obs) > tick + 2 {
                break;
            }
        }
    }
    let result = client.ask(json!({"op": "stop"})).await;
    let (ticks, missed) = (result["ticks"].as_u64(), result["missed_ticks"].as_u64());
    assert_eq!(missed.map(|missed| missed + 2), ticks, "{result}");
}

#[tokio::test]
async fn a_hand_whose_controller_is_silent_holds_still_after_a_while() {
    let server = Server::start();
    let (mut client, welcome, _) = playing(&server, "a").await;
    let hold = welcome["limits"]["hold_ticks"].as_u64().expect("a number");
    let away = json!({"base": {"linear": [0, 0, 0.1], "angular": [0, 0, 0]}, "hand": [0.5]});
    let ack = client.ask(json!({"op": "act", "action": away})).await;
    let first = tick_of(&ack);
    loop {
        let obs = client.streamed().await;
        let tick = tick_of(&obs);
        let speed = obs["applied_action"]["base"]["linear"][2].as_f64();
        let expected = match tick {
            tick if tick < first => None,
            tick if tick <= first + hold => Some(0.1),
            _ => Some(0.0),
        };
        assert_eq!(speed, expected, "{obs} after {ack}");
        if tick > first + hold + 5 {
            break;
        }
    }
}

#[tokio::test]
async fn each_mode_has_its_own_request() {
    let server = Server::start();
    let (mut client, _, _) = playing(&server, "a").await;
    client.refused(step(0), "wrong_state").await;
    client.refused(json!({"op": "act", "action": {"hand": [0.1, 0.2]}}), "bad_action").await;
    assert_eq!(client.ask(json!({"op": "stop"})).await["op"], "result");
    client.refused(act(0.5), "wrong_state").await;
    assert_eq!(client.ask(reset()).await["op"], "obs");
    client.refused(act(0.5), "wrong_state").await;
    client.goes_on(0).await;
}

#[tokio::test]
async fn the_world_goes_on_while_its_client_is_away() {
    let server = Server::start();
    let (client, welcome, opened) = playing(&server, "away").await;
    drop(client);
    tokio::time::sleep(Duration::from_millis(300)).await;
    let (mut again, back) = Client::resume(&server, &welcome["resume_token"]).await;
    let tick = back["run"]["tick"].as_u64().expect("a tick");
    assert_eq!((&back["run"]["open"], &back["run"]["mode"]), (&json!(true), &json!("realtime")), "{back}");
    assert!(tick > 0, "{back}");
    let streamed = again.streamed().await;
    assert!(tick_of(&streamed) + 1 >= tick && streamed["run_id"] == opened["run_id"], "{streamed}");
    let ack = again.ask(act(0.3)).await;
    assert!(tick_of(&ack) > tick, "{ack}");
    assert_eq!(again.ask(json!({"op": "stop"})).await["reason"], "stopped");
}

#[tokio::test]
async fn the_end_of_the_session_ends_the_stream_and_keeps_the_result() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    client.ask(json!({"op": "hello", "client": "timed", "session_s": 0.5})).await;
    client.ask(realtime()).await;
    let mut last = client.streamed().await;
    while last["truncated"] == false {
        last = client.streamed().await;
    }
    assert_eq!(last["reason"], "session_over", "{last}");
    // The wall clock is what counts: not a tick more fits into the session.
    assert!(tick_of(&last) <= 50, "{last}");
    client.refused(act(0.1), "session_over").await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["reason"], &result["ticks"]), (&json!("session_over"), &last["tick"]), "{result}");
}

#[tokio::test]
async fn a_push_moves_the_hand_in_practice() {
    let server = Server::start();
    for mode in ["lockstep", "realtime"] {
        let (mut client, _) = Client::greet(&server, mode).await;
        let mut request = reset();
        request["mode"] = mode.into();
        let obs = client.ask(request).await;
        let before = obs["truth"]["joints"]["position"].clone();
        let push = |link: &str, force: f64| json!({"op": "perturb", "link": link, "wrench": {"force": [0, 0, force]}, "duration_s": 0.05});
        let error = client.refused(push("tail", 1.0), "bad_request").await;
        assert!(error["message"].as_str().is_some_and(|text| text.contains("links: ")), "{error}");
        client.refused(push("index_distal", 1e9), "bad_request").await;
        let ack = client.ask(push("index_distal", 3.0)).await;
        assert_eq!(ack["op"], "ack", "{ack}");
        let tick = tick_of(&ack);
        let after = if mode == "lockstep" {
            client.ask(step(tick - 1)).await
        } else {
            let mut obs = client.streamed().await;
            while tick_of(&obs) < tick {
                obs = client.streamed().await;
            }
            obs
        };
        assert_ne!(after["truth"]["joints"]["position"], before, "{after}");
    }
}

#[tokio::test]
async fn the_world_after_the_last_place_is_refused() {
    let server = Server::start_with(&["--max-worlds", "3"]);
    let mut clients = Vec::new();
    for k in 0..3 {
        let (mut client, _) = Client::greet(&server, &format!("team {k}")).await;
        client.settled(realtime()).await;
        clients.push(client);
    }
    let (mut late, _) = Client::greet(&server, "late").await;
    let error = late.refused(realtime(), "capacity").await;
    assert!(error["retry_after_s"].as_f64().is_some_and(|seconds| seconds > 0.0), "{error}");
    // The other clients have noticed nothing.
    for client in &mut clients {
        assert_eq!(client.ask(act(0.2)).await["op"], "ack");
    }
    assert_eq!(clients[0].ask(json!({"op": "stop"})).await["op"], "result");
    assert_eq!(late.settled(realtime()).await["tick"], 0);
}
