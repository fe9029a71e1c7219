//! Pause, resume and end of all sessions at once.

use crate::harness::{Official, get, official_reset, step};
use serde_json::{Value, json};
use std::time::Duration;

fn left_s(time: &Value) -> f64 {
    time["session_left_s"].as_f64().expect("a number")
}

#[tokio::test]
async fn a_pause_of_the_competition_stops_every_session_also_those_that_begin_later_and_after_a_restart() {
    for cup in Official::each().await {
        let (crabs, rays, eels) = (cup.team("crabs"), cup.team("rays"), cup.team("eels"));
        cup.open();
        let (mut playing, welcome, _) = cup.playing(&crabs).await;
        let (mut realtime, _) = cup.greet(&rays).await;
        let reset = json!({"op": "reset", "task": "balls", "hand": "softhand", "mode": "realtime"});
        assert_eq!(realtime.ask(reset).await["op"], "obs");
        let done = cup.order("competition/pause", json!({"reason": "fire alarm"}));
        assert!(done["paused_unix_ms"].is_i64() && done["open_sessions"] == 2, "{done}");
        assert!(get(&cup.server, "/v1/competition").json()["paused_unix_ms"].is_i64());
        cup.post("/v1/admin/competition/pause", &cup.organizer, &json!({}))
            .assert_problem(409, "wrong_state");

        // Clocks and worlds stop, and the client learns why.
        let before = playing.ask(json!({"op": "time"})).await;
        let tick = realtime.ask(json!({"op": "time"})).await["run"]["tick"].clone();
        tokio::time::sleep(Duration::from_millis(200)).await;
        let after = playing.ask(json!({"op": "time"})).await;
        assert_eq!((left_s(&before), &after["paused"]), (left_s(&after), &json!(true)));
        assert_eq!(realtime.ask(json!({"op": "time"})).await["run"]["tick"], tick, "the world stops");
        let refusal = playing.ask(step(0)).await;
        assert_eq!((&refusal["code"], &refusal["retry_after_s"]), (&json!("wrong_state"), &json!(1.0)));
        assert!(refusal["message"].as_str().is_some_and(|text| text.contains("paused the competition")));

        // A session's own pause is another one.
        let one = json!({"session_id": welcome["session_id"]});
        cup.order("session/pause", one.clone());
        cup.order("session/resume", one);
        assert_eq!(playing.ask(json!({"op": "time"})).await["paused"], true);

        // Sessions that begin later are paused as well.
        let (mut late, _) = cup.greet(&eels).await;
        late.refused(official_reset(), "wrong_state").await;

        let cup = cup.crashed();
        let (mut playing, welcome) = cup.greet(&crabs).await;
        playing.refused(official_reset(), "wrong_state").await;
        let left = left_s(&welcome);
        tokio::time::sleep(Duration::from_millis(200)).await;
        assert_eq!(left_s(&playing.ask(json!({"op": "time"})).await), left, "it is paused after a restart");
        let done = cup.order("competition/resume", json!({}));
        assert_eq!((&done["paused_unix_ms"], &done["phase"]), (&Value::Null, &json!("open")));
        assert_eq!(playing.ask(official_reset()).await["op"], "obs");
        playing.goes_on(0).await;
        let (mut late, _) = cup.greet(&eels).await;
        assert_eq!(late.ask(official_reset()).await["op"], "obs");
        let records = cup.get("/v1/admin/audit", &cup.organizer).json()["records"].clone();
        let of = |action: &str| {
            records.as_array().expect("records").iter().filter(|record| record["action"] == action).count()
        };
        assert_eq!((of("competition.pause"), of("competition.resume")), (1, 1), "{records}");
    }
}

#[tokio::test]
async fn the_end_of_all_sessions_scores_their_runs_and_refuses_new_ones() {
    for cup in Official::each().await {
        let (crabs, rays, eels) = (cup.team("crabs"), cup.team("rays"), cup.team("eels"));
        cup.open();
        let (mut playing, welcome, obs) = cup.playing(&crabs).await;
        playing.goes_on(0).await;
        let (waiting, _) = cup.greet(&rays).await;
        drop(waiting);
        let refusal = cup.post("/v1/admin/competition/reveal", &cup.organizer, &json!({}));
        refusal.assert_problem(409, "wrong_state");
        let why = refusal.json()["detail"].as_str().expect("text").to_owned();
        let id = welcome["session_id"].as_str().expect("an id");
        for part in [
            "the competition is open",
            "2 sessions are open",
            "crabs",
            "rays",
            id,
            "left",
            "palmares admin end",
        ] {
            assert!(why.contains(part), "{part}: {why}");
        }
        let done = cup.order("competition/end", json!({"reason": "six o'clock"}));
        assert_eq!((&done["phase"], &done["open_sessions"]), (&json!("closed"), &json!(0)), "{done}");
        let result = playing.next().await;
        assert_eq!((&result["op"], &result["run_id"]), (&json!("result"), &obs["run_id"]), "{result}");
        assert_eq!(result["status"], "provisional", "{result}");
        assert_eq!(playing.closed().await.0, 1000);
        cup.verified(&obs["run_id"]).await;
        assert_eq!(get(&cup.server, "/v1/leaderboard").json()["rows"][0]["team"], "crabs");
        for token in [&crabs, &eels] {
            let mut client = cup.connect(token).await;
            let refusal = client.ask(json!({"op": "hello", "client": "test"})).await;
            assert_eq!(refusal["code"], "wrong_state", "{refusal}");
            assert!(refusal["message"].as_str().is_some_and(|text| text.contains("closed")), "{refusal}");
        }
        cup.post("/v1/admin/competition/end", &cup.organizer, &json!({})).assert_problem(409, "wrong_state");
        cup.order("competition/reveal", json!({}));
    }
}

#[tokio::test]
async fn reveal_names_what_is_in_its_way_and_runs_that_are_provisional() {
    let cup = Official::start();
    let crabs = cup.team("crabs");
    cup.open();
    let (mut client, _, _) = cup.playing(&crabs).await;
    client.goes_on(0).await;
    assert_eq!(client.ask(json!({"op": "stop"})).await["status"], "provisional");
    cup.order("competition/close", json!({}));
    let refusal = cup.post("/v1/admin/competition/reveal", &cup.organizer, &json!({}));
    let why = refusal.json()["detail"].as_str().expect("text").to_owned();
    assert!(why.starts_with("1 session is open: crabs (ses_") && why.contains("at most 9:5"), "{why}");
    let said = String::from_utf8_lossy(&cup.admin(&["reveal", "--yes"]).stderr).into_owned();
    assert!(said.contains("palmares admin end") && said.contains("crabs"), "{said}");
    assert!(cup.admin(&["end", "--yes", "--reason", "six o'clock"]).status.success());
    assert!(cup.admin(&["reveal", "--yes"]).status.success());
}
