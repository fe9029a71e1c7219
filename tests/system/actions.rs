//! Actions that are wrong: refused with `bad_action`, and the run continues.

use crate::harness::{Client, Server, assert_error};
use serde_json::{Value, json};

#[tokio::test]
async fn wrong_actions_are_refused_and_harm_nothing() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    let pose = |position: Value| json!({"base": {"position": position, "quat_xyzw": [0, 0, 0, 1]}});
    let cases = [
        ("wrong length of hand", json!({"hand": [0.1, 0.2]}), "action.hand"),
        ("empty hand", json!({"hand": []}), "action.hand"),
        ("wrong length of effort", json!({"effort": [0.1, 0.2]}), "action.effort"),
        ("wrong length of position", pose(json!([0, 0])), "action.base.position"),
        ("null for NaN", json!({"hand": [null]}), "action.hand[0]"),
        ("null in a pose", pose(json!([0, null, 0])), "action.base.position[1]"),
        ("a word for NaN", json!({"hand": ["NaN"]}), "action.hand[0]"),
        ("half a pose", json!({"base": {"position": [0, 0, 1]}}), "action.base"),
        ("no rotation", json!({"base": {"position": [0, 0, 1], "quat_xyzw": [0, 0, 0, 0]}}), "quat_xyzw"),
        ("unknown field", json!({"grip": 1}), "`grip`"),
        ("not an object", json!([1]), "action"),
    ];
    for (tick, (what, action, named)) in cases.into_iter().enumerate() {
        let tick = tick as u64;
        let step = json!({"op": "step", "tick": tick, "action": action});
        let error = client.refused(step, "bad_action").await;
        assert!(error["message"].as_str().is_some_and(|text| text.contains(named)), "{what}: {error}");
        client.goes_on(tick).await;
    }
}

#[tokio::test]
async fn numbers_that_json_does_not_have_are_bad_json() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    for (tick, number) in ["NaN", "Infinity", "-Infinity", "1e999", "-1e999"].into_iter().enumerate() {
        let text = format!(r#"{{"op":"step","id":1,"tick":{tick},"action":{{"hand":[{number}]}}}}"#);
        client.send(&text).await;
        assert_error(&client.next().await, "bad_json", false);
        client.goes_on(tick as u64).await;
    }
}

#[tokio::test]
async fn commands_out_of_range_are_clipped_and_reported() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    let obs = client.ask(json!({"op": "step", "tick": 0, "action": {"hand": [7.5]}})).await;
    assert_eq!(obs["applied_action"]["hand"], json!([1.0]));
    let obs = client.ask(json!({"op": "step", "tick": 1, "action": {}})).await;
    assert_eq!(obs["applied_action"]["hand"], json!([1.0]), "what is left out keeps its last target");
}

#[tokio::test]
async fn an_effort_limits_the_pull_of_the_motors_until_another_comes() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "a").await;
    let mut tick = 0;
    // Four seconds with an action; the tension after them.
    let mut play = async |action: Value| {
        let mut obs = Value::Null;
        for _ in 0..4 {
            obs = client.ask(json!({"op": "step", "tick": tick, "repeat": 100, "action": action})).await;
            tick += 100;
        }
        (obs["hand"]["actuators"][0]["tension"].as_f64().expect("a tension"), obs["applied_action"].clone())
    };
    let (whole, applied) = play(json!({"hand": [1.0]})).await;
    assert!(applied.get("effort").is_none(), "no run has one before its first: {applied}");
    let (part, applied) = play(json!({"effort": [0.25]})).await;
    assert_eq!(applied["effort"], json!([0.25]));
    assert!(part < 0.35 * whole, "{part} of {whole}");
    let (kept, applied) = play(json!({})).await;
    assert_eq!(applied["effort"], json!([0.25]), "what is left out keeps its last target");
    assert!((kept / part - 1.0).abs() < 1e-3, "{kept} {part}");
    let (again, applied) = play(json!({"effort": [7.0]})).await;
    assert_eq!(applied["effort"], json!([1.0]));
    assert!(again > 0.9 * whole, "{again} of {whole}");
}
