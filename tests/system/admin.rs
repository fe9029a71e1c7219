//! Administration: orders, their records, the command line.

use crate::harness::{Official, get, official_reset, step};
use serde_json::{Value, json};

fn ended(client_time: &Value) -> f64 {
    client_time["session_left_s"].as_f64().expect("a number")
}

#[tokio::test]
async fn a_paused_session_stands_still() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome, _) = cup.playing(&token).await;
        client.goes_on(0).await;
        let session = json!({"session_id": welcome["session_id"], "reason": "fire drill"});
        let row = cup.order("session/pause", session.clone())["session"].clone();
        assert!(row["paused_unix_ms"].is_i64(), "{row}");
        let first = ended(&client.ask(json!({"op": "time"})).await);
        tokio::time::sleep(std::time::Duration::from_millis(300)).await;
        assert_eq!(ended(&client.ask(json!({"op": "time"})).await), first);
        cup.post("/v1/admin/session/pause", &cup.organizer, &session).assert_problem(409, "wrong_state");
        cup.order("session/resume", session);
        client.goes_on(1).await;
    }
}

#[tokio::test]
async fn a_voided_run_counts_for_nothing_and_its_time_is_given_back() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, _, obs) = cup.playing(&token).await;
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 100})).await;
        let result = client.ask(json!({"op": "stop"})).await;
        assert_eq!(result["status"], "provisional", "{result}");
        cup.verified(&result["run_id"]).await;
        let rows = get(&cup.server, "/v1/leaderboard").json()["rows"].clone();
        assert_eq!(rows[0]["tasks"]["balls"]["status"], "verified", "{rows}");
        let before = client.ask(json!({"op": "time"})).await;
        let nameless = json!({"run_id": obs["run_id"]});
        cup.post("/v1/admin/run/void", &cup.organizer, &nameless).assert_problem(400, "bad_request");
        let void = json!({"run_id": obs["run_id"], "reason": "the table was hit"});
        assert_eq!(cup.order("run/void", void.clone())["run"]["status"], "voided");
        cup.post("/v1/admin/run/void", &cup.organizer, &void).assert_problem(409, "wrong_state");
        assert_eq!(get(&cup.server, "/v1/leaderboard").json()["rows"], json!([]));
        let after = client.ask(json!({"op": "time"})).await;
        assert!(after["refunded_s"].as_f64() > before["refunded_s"].as_f64(), "{before} {after}");

        // An order also voids an open run: its client learns this from the next request.
        let obs = client.ask(official_reset()).await;
        cup.order("run/void", json!({"run_id": obs["run_id"], "reason": "again"}));
        client.refused(step(0), "wrong_state").await;
        let result = client.ask(json!({"op": "stop"})).await;
        assert_eq!(result["status"], "voided", "{result}");
    }
}

#[tokio::test]
async fn a_voided_session_gives_the_team_another_and_granted_time_is_added() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome, _) = cup.playing(&token).await;
        let grant = json!({"session_id": welcome["session_id"], "seconds": 100.0, "reason": "late start"});
        let row = cup.order("session/grant", grant)["session"].clone();
        assert_eq!(row["limit_s"], 700.0, "{row}");
        assert_eq!(client.ask(json!({"op": "time"})).await["session_s"], 700.0);
        let void = json!({"session_id": welcome["session_id"], "reason": "wrong table"});
        cup.order("session/void", void);
        let result = client.next().await;
        assert_eq!((&result["op"], &result["status"]), (&json!("result"), &json!("voided")), "{result}");
        assert_eq!(client.closed().await.0, 1000);
        let (_, second) = cup.greet(&token).await;
        assert_ne!(second["session_id"], welcome["session_id"]);
        assert_eq!(second["session_left_s"], 600.0);
    }
}

#[tokio::test]
async fn time_granted_to_a_session_that_is_over_opens_it_again() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut client, welcome, _) = cup.playing(&token).await;
    cup.order("session/end", json!({"session_id": welcome["session_id"]}));
    assert_eq!(client.next().await["op"], "result");
    assert_eq!(client.closed().await.0, 1000);
    let grant = json!({"session_id": welcome["session_id"], "seconds": 60.0, "reason": "ended by mistake"});
    cup.order("session/grant", grant);
    let (mut client, back) = cup.greet(&token).await;
    assert_eq!(back["session_id"], welcome["session_id"], "{back}");
    assert_eq!(client.ask(official_reset()).await["op"], "obs");
}

#[tokio::test]
async fn every_action_is_recorded_and_a_refused_one_is_not() {
    for cup in Official::each().await {
        cup.team("crabs");
        let again = json!({"team": "crabs"});
        cup.post("/v1/admin/team/add", &cup.organizer, &again).assert_problem(409, "wrong_state");
        cup.post("/v1/admin/team/rotate", &cup.organizer, &json!({"team": "x"}))
            .assert_problem(404, "not_found");
        cup.post("/v1/admin/team/add", &cup.organizer, &json!({"name": "x"}))
            .assert_problem(400, "bad_request");
        cup.order("competition/open", json!({"reason": "it is nine"}));
        let records = cup.get("/v1/admin/audit", &cup.organizer).json()["records"].clone();
        let actions: Vec<&str> = records
            .as_array()
            .expect("records")
            .iter()
            .map(|record| record["action"].as_str().expect("an action"))
            .collect();
        assert_eq!(actions, ["token.issue", "team.add", "token.issue", "competition.open"], "{records}");
        assert_eq!(records[3]["reason"], "it is nine");
        assert_ne!(records[3]["actor"], "server");
    }
}

#[tokio::test]
async fn a_list_of_sessions_has_their_present_clocks() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome, _) = cup.playing(&token).await;
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 100})).await;
        // A run is open: the database knows the clock as it was before.
        let session = |cup: &Official| cup.get("/v1/sessions", &cup.organizer).json()["sessions"][0].clone();
        let row = session(&cup);
        let number = |name: &str| row[name].as_f64().expect(name);
        assert!((number("clock_simulated_s") - 1.0).abs() < 1e-9, "{row}");
        assert!(number("clock_wall_s") > 0.0, "{row}");
        assert_eq!(number("elapsed_s"), number("clock_wall_s").max(number("clock_simulated_s")));
        assert_eq!(number("left_s"), 600.0 - number("elapsed_s"));
        let id = json!({"session_id": welcome["session_id"]});
        cup.order("session/pause", id.clone());
        assert_eq!(session(&cup)["pauses"], 1);
        let left_s = session(&cup)["left_s"].as_f64().expect("a number");
        assert_eq!(session(&cup)["left_s"], left_s, "it stands still");
        let left = format!(" {}:{:02} ", left_s as u64 / 60, left_s as u64 % 60);
        let output = cup.admin(&["session", "list"]);
        let said = String::from_utf8(output.stdout).expect("text");
        let line = said.lines().nth(1).expect("a session");
        assert!(
            line.contains(" crabs ") && line.contains(" paused since 20") && line.contains(&left),
            "{said}"
        );
        let json = cup.admin(&["session", "list", "--json"]).stdout;
        let listed: Value = serde_json::from_slice(&json).expect("JSON");
        assert_eq!(listed["sessions"][0]["team"], "crabs");
        let csv = cup.get("/v1/admin/export/sessions?format=csv", &cup.organizer).body;
        assert!(csv.starts_with("session_id,team,mode,status,created_utc,ended_utc,limit_s,"), "{csv}");
        assert!(csv.contains(",official,open,20") && csv.contains("Z,,600.0,"), "{csv}");
        cup.order("session/end", id);
        assert!((session(&cup)["clock_simulated_s"].as_f64().expect("s") - 1.0).abs() < 1e-9);
    }
}

#[test]
fn what_is_final_is_not_done_unasked() {
    let cup = Official::start();
    for command in ["pause", "resume", "end", "reveal"] {
        let output = cup.admin(&[command]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains("Test Cup") && said.contains("--yes"), "{said}");
    }
    assert_eq!(get(&cup.server, "/v1/competition").json()["phase"], "closed");
    assert!(cup.admin(&["reveal", "--yes"]).status.success());
    assert_eq!(get(&cup.server, "/v1/competition").json()["phase"], "revealed");
}

#[tokio::test]
async fn the_command_line_does_it_all() {
    let cup = Official::start();
    let run = |arguments: &[&str]| {
        let output = cup.admin(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {said}");
        String::from_utf8(output.stdout).expect("text")
    };
    let json = |text: String| serde_json::from_str::<Value>(&text).expect("JSON");
    assert_eq!(json(run(&["status"]))["phase"], "closed");
    let token = json(run(&["team", "add", "crabs"]))["token"].as_str().expect("a token").to_owned();
    assert_eq!(json(run(&["open", "--reason", "nine o'clock"]))["phase"], "open");
    let (mut client, welcome, _) = cup.playing(&token).await;
    let session = welcome["session_id"].as_str().expect("an id").to_owned();
    run(&["session", "pause", &session, "--reason", "alarm"]);
    run(&["session", "resume", &session]);
    run(&["session", "grant", &session, "--seconds", "30", "--reason", "alarm"]);
    client.goes_on(0).await;
    let result = client.ask(json!({"op": "stop"})).await;
    let run_id = result["run_id"].as_str().expect("an id").to_owned();
    cup.verified(&result["run_id"]).await;
    assert!(run(&["session", "list"]).contains(&session));
    let table = run(&["export", "leaderboard"]);
    assert!(table.starts_with("rank,team,total,balls,balls_status,balls_run_id,"), "{table}");
    assert!(table.contains("crabs") && table.contains(&run_id), "{table}");
    assert_eq!(get(&cup.server, "/v1/leaderboard.csv").body, table);
    assert_eq!(json(run(&["export", "runs", "--format", "json"]))[0]["k"], 1);
    assert!(run(&["run", "list"]).contains(&run_id));
    assert_eq!(json(run(&["run", "list", "--json"]))["runs"][0]["run_id"], run_id);
    assert_eq!(json(run(&["run", "show", &run_id]))["status"], "verified");
    run(&["run", "void", &run_id, "--reason", "mistake"]);
    assert!(!run(&["export", "leaderboard"]).contains("crabs"));
    let records = json(run(&["audit", "--json"]))["records"].clone();
    assert!(records.as_array().expect("records").iter().any(|r| r["action"] == "session.grant"), "{records}");
    run(&["token", "add", "viewer", "--label", "screen"]);
    assert!(run(&["token", "list"]).contains("screen"));
    run(&["team", "revoke", "crabs"]);
    run(&["close"]);

    let output = cup.admin(&["session", "void", &session]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("reason"), "{said}");
    let output = cup.admin(&["session", "pause", "ses_none"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("no session"), "{output:?}");
}
