//! Time given back for runs that ended before the server died and are voided after it: all of it, once.

use crate::harness::{Client, Official, official_reset};
use serde_json::{Value, json};
use sqlx::ConnectOptions;
use sqlx::sqlite::SqliteConnectOptions;
use tempfile::TempDir;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

/// Plays `seconds` and stops. Returns the result.
async fn played(client: &mut Client, seconds: u64) -> Value {
    assert_eq!(client.ask(official_reset()).await["op"], "obs");
    for tick in 0..seconds {
        client.ask(json!({"op": "step", "tick": tick * 100, "action": {}, "repeat": 100})).await;
    }
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
    result
}

fn void(cup: &Official, run_id: &Value) -> Value {
    cup.order("run/void", json!({"run_id": run_id, "reason": "the table was hit"}))["session"].clone()
}

#[tokio::test]
async fn a_run_that_ended_before_a_crash_gives_its_time_back_after_it() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, _) = cup.greet(&token).await;
        let first = played(&mut client, 3).await;
        let second = played(&mut client, 4).await;
        let time = client.ask(json!({"op": "time"})).await;
        assert_eq!(number(&time["simulated_s"]), 7.0, "{time}");

        let cup = cup.crashed();
        let session = void(&cup, &first["run_id"]);
        assert!(number(&session["refunded_s"]) > 0.0, "{session}");
        let (mut client, _) = cup.greet(&token).await;
        let time = client.ask(json!({"op": "time"})).await;
        assert_eq!(number(&time["simulated_s"]), 4.0, "{time}");
        let again = json!({"run_id": first["run_id"], "reason": "once more"});
        cup.post("/v1/admin/run/void", &cup.organizer, &again).assert_problem(409, "wrong_state");
        // While another run is open, which the next crash cuts off.
        assert_eq!(client.ask(official_reset()).await["op"], "obs");
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 100})).await;
        void(&cup, &second["run_id"]);
        let time = client.ask(json!({"op": "time"})).await;
        assert_eq!(number(&time["simulated_s"]), 1.0, "{time}");

        let cup = cup.crashed();
        let (mut client, _) = cup.greet(&token).await;
        let time = client.ask(json!({"op": "time"})).await;
        assert_eq!(number(&time["simulated_s"]), 0.0, "{time}");
        assert!(number(&time["refunded_s"]) > 0.0, "{time}");
    }
}

const SHORT: &str =
    "name = \"Short Cup\"\nmode = \"official\"\nsession_s = 2\nsessions_per_team = 1\nreset_cost_s = 0\n";

#[tokio::test]
async fn a_session_whose_time_was_spent_on_a_void_run_goes_on() {
    for crash in [false, true] {
        let folder = TempDir::new().expect("temporary directory");
        let mut cup = Official::start_on(folder, SHORT, None);
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome) = cup.greet(&token).await;
        let spoilt = played(&mut client, 1).await;
        assert_eq!(client.ask(official_reset()).await["op"], "obs");
        // On a slow machine the wall clock may win, and then the step itself is refused.
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 100})).await;
        let last = client.ask(json!({"op": "stop"})).await;
        assert_eq!(last["reason"], "session_over", "{last}");
        assert_eq!(last["session_left_s"], 0.0, "{last}");
        cup.order("session/end", json!({"session_id": welcome["session_id"]}));
        assert_eq!(client.closed().await.0, 1000);
        if crash {
            cup = cup.crashed();
        }
        let mut late = cup.connect(&token).await;
        late.refused(json!({"op": "hello", "client": "late"}), "session_over").await;
        let session = void(&cup, &spoilt["run_id"]);
        assert_eq!(session["status"], "open", "{session}");
        let (_, back) = cup.greet(&token).await;
        assert_eq!(back["session_id"], welcome["session_id"], "{back}");
        assert!(number(&back["session_left_s"]) > 0.0, "{back}");
    }
}

#[tokio::test]
async fn a_team_begins_its_next_session_at_once_after_it_has_lost_a_spent_one() {
    let rules = SHORT.replace("sessions_per_team = 1", "sessions_per_team = 2");
    let cup = Official::start_on(TempDir::new().expect("temporary directory"), &rules, None);
    let token = cup.team("crabs");
    cup.open();
    let mut ids = Vec::new();
    for _ in 0..2 {
        let (mut client, welcome) = cup.greet(&token).await;
        assert_eq!(client.ask(official_reset()).await["op"], "obs");
        for tick in [0, 100] {
            client.ask(json!({"op": "step", "tick": tick, "action": {}, "repeat": 100})).await;
        }
        assert_eq!(client.ask(json!({"op": "time"})).await["session_left_s"], 0.0);
        assert_eq!(client.ask(json!({"op": "stop"})).await["reason"], "session_over");
        ids.push(welcome["session_id"].clone());
        // As a program that crashes: it does not say bye, and the session waits for it.
        drop(client);
    }
    assert_ne!(ids[0], ids[1]);
    // The last one is shown, without time: the organizers may give it some.
    let (_, last) = cup.greet(&token).await;
    assert_eq!((&last["session_id"], number(&last["session_left_s"])), (&ids[1], 0.0), "{last}");
}

#[tokio::test]
async fn time_that_was_owed_when_the_server_died_is_given_back_at_the_next_start() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut client, _) = cup.greet(&token).await;
    let run = played(&mut client, 3).await;
    let (folder, rules) = cup.killed();
    // The state after a death between the two halves of voiding the run.
    let options = SqliteConnectOptions::new().filename(folder.path().join("palmares.sqlite"));
    let mut database = options.connect().await.expect("opens");
    let voided = sqlx::query("UPDATE runs SET status = 'voided' WHERE run_id = $1")
        .bind(run["run_id"].as_str().expect("an id"))
        .execute(&mut database);
    assert_eq!(voided.await.expect("query").rows_affected(), 1);
    drop(database);

    let mut cup = Official::start_on(folder, &rules, None);
    for _ in 0..2 {
        let (mut client, _) = cup.greet(&token).await;
        let time = client.ask(json!({"op": "time"})).await;
        assert_eq!((number(&time["simulated_s"]), number(&time["refunded_s"]) > 0.0), (0.0, true), "{time}");
        cup = cup.crashed();
    }
}
