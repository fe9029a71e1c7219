//! Senses over the real socket: the organizer's choice, the recorded data, the pictures.

use crate::harness::{Client, Official, RULES, Server, get, official_reset};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use tempfile::TempDir;

fn cup(more: &str) -> Official {
    Official::start_on(TempDir::new().expect("a folder"), &format!("{RULES}{more}"), None)
}

fn practice_reset() -> Value {
    json!({"op": "reset", "task": "balls", "hand": "softhand", "seed": 7})
}

fn with(mut request: Value, field: &str, value: Value) -> Value {
    request[field] = value;
    request
}

#[tokio::test]
async fn where_the_truth_is_not_shown_it_is_refused_and_a_run_on_sensors_is_recorded_as_one() {
    let cup = cup("sensors_only = [\"balls\"]\n");
    let token = cup.team("crabs");
    cup.open();
    let (mut client, welcome) = cup.greet(&token).await;
    let competition = &welcome["competition"];
    assert_eq!((&competition["noise"], &competition["sensors_only"]), (&json!("real"), &json!(["balls"])));
    for request in [official_reset(), with(official_reset(), "sensing", json!("truth"))] {
        let refused = client.ask(request).await;
        assert_eq!(refused["code"], "bad_request", "{refused}");
        assert!(refused["message"].as_str().is_some_and(|text| text.contains("sensors")), "{refused}");
    }
    let sensors = || with(official_reset(), "sensing", json!("sensors"));
    let refused = client.ask(with(sensors(), "noise", json!("none"))).await;
    assert_eq!(refused["code"], "bad_request", "{refused}");
    let refused = client.ask(with(sensors(), "cameras", json!(["eye"]))).await;
    assert_eq!(refused["code"], "unknown_camera", "{refused}");
    let opened = client.ask(with(sensors(), "cameras", json!(["box_a"]))).await;
    assert_eq!((&opened["run"]["sensing"], &opened["run"]["noise"]), (&json!("sensors"), &json!("real")));
    assert_eq!(opened["cameras"][0]["camera"], "box_a");
    let hidden =
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "cameras": ["box_a.bodies"]})).await;
    assert_eq!(hidden["code"], "unknown_camera", "{hidden}");
    let obs =
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 30, "cameras": ["wrist"]})).await;
    assert_eq!((&obs["tick"], &obs["truth"]), (&json!(30), &Value::Null), "{obs}");
    let result = client.ask(json!({"op": "stop"})).await;
    cup.verified(&result["run_id"]).await;
    let rows: Value = serde_json::from_str(&get(&cup.server, "/v1/leaderboard").body).expect("JSON");
    assert_eq!(rows["rows"][0]["sensors_only"], true, "{rows}");
}

#[tokio::test]
async fn a_picture_is_the_same_in_every_run_of_a_seed_and_other_with_noise() {
    let server = Server::start();
    let mut images: Vec<Value> = Vec::new();
    for noise in ["none", "real", "real"] {
        let (mut client, _) = Client::greet(&server, "eyes").await;
        let request = with(with(practice_reset(), "noise", json!(noise)), "sensing", json!("sensors"));
        client.ask(request).await;
        let step =
            json!({"op": "step", "tick": 0, "action": {}, "repeat": 20, "cameras": ["box_a", "box_a.rgb"]});
        let obs = client.ask(step).await;
        let image = obs["cameras"][0].clone();
        let bytes =
            |channel: &str| STANDARD.decode(image[channel].as_str().expect("pixels")).expect("base64").len();
        assert_eq!((bytes("depth"), bytes("rgb")), (2 * 320 * 240, 3 * 320 * 240));
        images.push(image);
        client.ask(json!({"op": "stop"})).await;
    }
    assert_eq!(images[1], images[2]);
    assert_ne!(images[0]["depth"], images[1]["depth"]);
    assert_eq!((&images[0]["tick"], &images[1]["tick"]), (&json!(20), &json!(10)));
}

#[tokio::test]
async fn what_is_no_camera_is_refused_with_those_there_are_and_nothing_is_stepped() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "eyes").await;
    let refused = client.ask(json!({"op": "step", "tick": 0, "action": {}, "cameras": ["eye"]})).await;
    assert_eq!(refused["code"], "unknown_camera", "{refused}");
    let message = refused["message"].as_str().expect("a text");
    assert!(message.contains("box_a") && message.contains("wrist"), "{message}");
    let obs = client.ask(json!({"op": "step", "tick": 0, "action": {}, "cameras": ["wrist"]})).await;
    assert_eq!(obs["tick"], 1, "{obs}");
}
