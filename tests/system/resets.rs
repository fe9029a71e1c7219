//! Official resets: their cost, what they show, and when they are refused.

use crate::hands_upload::claw_with;
use crate::harness::{Official, RULES, bearer, official_reset, send, step};
use serde_json::{Value, json};
use tempfile::TempDir;

fn start(rules: &str) -> Official {
    Official::start_on(TempDir::new().expect("temporary directory"), rules, None)
}

#[tokio::test]
async fn each_reset_costs_time_that_a_void_run_gets_back() {
    let cup = start("mode = \"official\"\nsession_s = 600\nreset_cost_s = 200\n");
    let token = cup.team("crabs");
    cup.open();
    let (mut client, welcome) = cup.greet(&token).await;
    assert_eq!(welcome["competition"]["reset_cost_s"], 200.0, "{welcome}");
    assert_eq!(cup.get("/v1/competition", &token).json()["reset_cost_s"], 200.0);
    let left = |message: &Value| message["session_left_s"].as_f64().expect("a number");
    let obs = client.ask(official_reset()).await;
    assert!(left(&obs) <= 400.0, "{obs}");
    // A run without a step: it counts, but there is nothing to verify.
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["status"], &result["ticks"]), (&json!("aborted"), &json!(0)), "{result}");
    assert!(result.get("replay").is_none() && left(&result) <= 400.0, "{result}");
    let run = |id: &Value| cup.get(&format!("/v1/runs/{}", id.as_str().expect("id")), &cup.organizer).json();
    let looked = run(&result["run_id"]);
    assert_eq!((&looked["status"], &looked["k"]), (&json!("aborted"), &json!(1)), "{looked}");
    assert_eq!(std::fs::read_dir(cup.folder().join("replays")).expect("folder").count(), 0);

    let obs = client.ask(official_reset()).await;
    assert!(left(&obs) <= 200.0, "{obs}");
    client.ask(step(0)).await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
    cup.verified(&result["run_id"]).await;
    assert_eq!(run(&result["run_id"])["k"], 2);
    let refused = client.refused(official_reset(), "session_over").await;
    assert!(
        refused["message"].as_str().expect("text").contains("a reset needs more than 200 s"),
        "{refused}"
    );

    cup.order("run/void", json!({"run_id": result["run_id"], "reason": "the lights went out"}));
    let time = client.ask(json!({"op": "time"})).await;
    assert!(time["refunded_s"].as_f64().expect("a number") >= 200.0 && left(&time) > 200.0, "{time}");
    let obs = client.ask(official_reset()).await;
    assert_eq!((&obs["op"], &run(&obs["run_id"])["k"]), (&json!("obs"), &json!(3)), "{obs}");
}

#[tokio::test]
async fn a_cost_that_no_session_can_pay_is_refused() {
    let folder = TempDir::new().expect("temporary directory");
    let file = folder.path().join("competition.toml");
    std::fs::write(&file, "mode = \"official\"\nsession_s = 10\n").expect("rules");
    let mut command = std::process::Command::new(crate::harness::program());
    let output = command.args(["serve", "--config"]).arg(&file).output().expect("palmares runs");
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && printed.contains("reset_cost_s = 10"), "{printed}");
}

#[tokio::test]
async fn a_hand_in_the_way_is_refused_and_with_sensors_no_object_is_given_away() {
    // The rules allow plates.
    let wide = "[hand_limits]\nsize_m = inf\nreach_m = inf\nlink_size_m = inf\nvolume_m3 = inf\n";
    let cup = start(&format!("{RULES}tasks = [\"grasp\"]\n{wide}"));
    let token = cup.team("crabs");
    // A plate 3 cm above the table, through everything on it: so long a hand begins 0.3 m higher than others.
    let plate = "<collision><origin xyz=\"0 0 0.82\"/><geometry><box size=\"0.24 0.24 0.02\"/></geometry></collision>\n  </link>";
    let files = claw_with("plate", &|urdf| urdf.replacen("</link>", plate, 1));
    let sent = send(&cup.server, "POST", "/v1/hands", &bearer(&token), &files);
    sent.assert_problem(422, "hand_in_the_way");
    assert!(sent.body.contains("link `palm` "), "{}", sent.body);

    cup.open();
    let (mut client, _) = cup.greet(&token).await;
    let reset = json!({"op": "reset", "task": "grasp", "hand": "pinch", "sensing": "sensors"});
    let obs = client.ask(reset).await;
    for body in obs["scene"]["bodies"].as_array().expect("bodies") {
        let free = body["free"] == true;
        assert_eq!(body.get("position").is_none(), free, "{body}");
        assert_eq!(body.get("quat_xyzw").is_none(), free, "{body}");
        assert!(body["parts"].as_array().is_some_and(|parts| !parts.is_empty()), "{body}");
    }
}
