//! A fleet whose database fails between two statements, or while an organizer gives an order. The tests write the rows that are left
//! then.

use crate::harness::fleet::{free_port, resumed, rules, two_hosts};
use crate::harness::{Client, Official, official_reset as reset, postgres_database};
use serde_json::{Value, json};
use sqlx::postgres::{PgConnectOptions, PgConnection};
use sqlx::{AssertSqlSafe, ConnectOptions, Executor};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest wait for something that takes a few seconds.
const PATIENCE: Duration = Duration::from_secs(20);

async fn database(official: &Official) -> PgConnection {
    let url = official.database_url.as_ref().expect("Postgres");
    let options: PgConnectOptions = url.parse().expect("URL");
    options.connect().await.expect("connects")
}

/// Changes the row of a session.
async fn change(official: &Official, session: &Value, what: &str) {
    let id = session["session_id"].as_str().expect("an id");
    let sql = format!("UPDATE sessions SET {what} WHERE session_id = '{id}'");
    let changed = database(official).await.execute(AssertSqlSafe(sql)).await.expect("changes it");
    assert_eq!(changed.rows_affected(), 1);
}

/// Begins a session with a run.
async fn playing(official: &Official, team: &str) -> (Client, Value, Value) {
    let (mut client, welcome) = official.greet(team).await;
    let obs = client.ask(reset()).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    for tick in 0..30 {
        client.goes_on(tick).await;
    }
    (client, welcome, obs)
}

/// Waits until the session is paused, or not.
async fn until_paused(client: &mut Client, paused: bool) {
    let began = Instant::now();
    while client.ask(json!({"op": "time"})).await["paused"] != paused {
        assert!(began.elapsed() < PATIENCE);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test]
async fn a_session_that_its_owner_does_not_have_is_taken_over() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome, obs) = playing(&first, &team).await;
    // The first host takes it over, and does not get the answer.
    change(&first, &welcome, "epoch = epoch + 1").await;
    assert_eq!(client.closed().await, (1012, "session_moved".into()));
    let (mut client, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    assert_eq!(again["run"]["run_id"], obs["run_id"], "{again}");
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
}

#[tokio::test]
async fn an_order_that_has_not_found_the_session_is_followed() {
    let Some((first, _second, team)) = two_hosts().await else { return };
    let (mut client, welcome, obs) = playing(&first, &team).await;
    change(&first, &welcome, "paused_at = 1").await;
    until_paused(&mut client, true).await;
    change(&first, &welcome, "paused_at = NULL").await;
    until_paused(&mut client, false).await;
    change(&first, &welcome, "status = 'ended', ended_at = 1, owner = NULL").await;
    let result = client.next().await;
    assert_eq!((&result["op"], &result["run_id"]), (&json!("result"), &obs["run_id"]), "{result}");
    assert_eq!(client.closed().await, (1000, "session_over".into()));
}

#[tokio::test]
async fn the_last_ticks_of_a_run_that_cannot_be_stored_are_not_shown() {
    let Some(url) = postgres_database().await else { return };
    let (folder, port) = (TempDir::new().expect("temporary directory"), free_port());
    let rules = rules("h1", port).replace("session_s = 600", "session_s = 20");
    let listen = format!("127.0.0.1:{port}");
    let first = Official::start_with(folder, &rules, Some(url), &["--listen", &listen]);
    first.open();
    let (mut client, welcome) = first.greet(&first.team("crabs")).await;
    let mut obs = client.ask(reset()).await;
    let left = |obs: &Value| obs["session_left_s"].as_f64().expect("seconds");
    while left(&obs) > 0.9 {
        let tick = obs["tick"].as_u64().expect("a tick");
        obs = client.ask(json!({"op": "step", "tick": tick, "repeat": 50, "action": {}})).await;
        assert_eq!(obs["op"], "obs", "{obs}");
    }
    // Nobody writes the session's row for a while.
    let mut lock = database(&first).await;
    let id = welcome["session_id"].as_str().expect("an id");
    lock.execute("BEGIN").await.expect("begins");
    let sql = format!("SELECT epoch FROM sessions WHERE session_id = '{id}' FOR UPDATE");
    lock.execute(AssertSqlSafe(sql)).await.expect("locks");
    let unlock = async {
        tokio::time::sleep(Duration::from_secs(4)).await;
        lock.execute("ROLLBACK").await.expect("unlocks");
    };
    let step = async {
        let tick = obs["tick"].as_u64().expect("a tick");
        let last = client.ask(json!({"op": "step", "tick": tick, "repeat": 100, "action": {}})).await;
        let count = "SELECT COALESCE(SUM(ticks), 0)::BIGINT FROM run_actions";
        let stored: i64 =
            sqlx::query_scalar(count).fetch_one(&mut database(&first).await).await.expect("counts");
        (last, stored)
    };
    let ((last, stored), ()) = tokio::join!(step, unlock);
    let tick = last["tick"].as_i64().expect("a tick");
    assert!(tick <= stored + 25, "the client sees tick {tick}, and {stored} are stored");
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
}
