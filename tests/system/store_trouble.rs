//! A database that refuses writes: `internal`, and nothing is lost.

use crate::harness::{Client, Official, Server, get, official_reset, reset, step};
use serde_json::json;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{ConnectOptions, Connection};
use std::time::{Duration, Instant};

/// Another program that holds the database's write lock.
async fn hold(server: &Server) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(server.database());
    let mut holder = options.connect().await.expect("opens");
    sqlx::query("BEGIN IMMEDIATE").execute(&mut holder).await.expect("locks");
    holder
}

#[tokio::test]
async fn a_result_that_cannot_be_stored_is_not_lost_and_not_sent() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "patient").await;
    client.goes_on(0).await;

    let holder = hold(&server).await;
    client.refused(json!({"op": "stop"}), "internal").await;
    client.refused(step(1), "wrong_state").await;
    holder.close().await.expect("unlocks");

    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["ticks"]), (&json!("result"), &json!(1)), "{result}");
    let run = get(&server, &format!("/v1/runs/{}", result["run_id"].as_str().expect("an id"))).json();
    assert_eq!((&run["status"], &run["score"]), (&json!("practice"), &result["score"]), "{run}");
}

#[tokio::test]
async fn a_run_that_cannot_be_stored_is_not_opened() {
    let server = Server::start_with(&["--max-worlds", "1"]);
    let (mut client, _) = Client::greet(&server, "patient").await;

    let holder = hold(&server).await;
    client.refused(reset(), "internal").await;
    client.refused(step(0), "wrong_state").await;
    holder.close().await.expect("unlocks");

    let mut obs = client.ask(reset()).await;
    // The refused run's world may need a moment to give its place back.
    while obs["code"] == "capacity" {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
        obs = client.ask(reset()).await;
    }
    assert_eq!(obs["tick"], 0, "{obs}");
    client.goes_on(0).await;
}

#[tokio::test]
async fn the_time_until_the_database_takes_it_is_not_the_teams() {
    let cup = Official::start();
    let token = cup.team("patient");
    cup.open();
    let (mut client, _, _) = cup.playing(&token).await;
    client.goes_on(0).await;
    let wall_s = |time: &serde_json::Value| time["wall_s"].as_f64().expect("a number");
    for request in [json!({"op": "stop"}), official_reset()] {
        let before = client.ask(json!({"op": "time"})).await;
        let holder = hold(&cup.server).await;
        let trouble = Instant::now();
        client.refused(request.clone(), "internal").await;
        let trouble_s = trouble.elapsed().as_secs_f64();
        holder.close().await.expect("unlocks");
        let done = client.ask(request).await;
        assert!(done["op"] == "result" || done["op"] == "obs", "{done}");
        let after = client.ask(json!({"op": "time"})).await;
        assert!(after["refunded_s"].as_f64() > before["refunded_s"].as_f64(), "{before} {after}");
        assert!(wall_s(&after) - wall_s(&before) < trouble_s, "{before} {after}: {trouble_s} s of trouble");
    }
}

#[tokio::test]
async fn a_slow_database_costs_the_team_nothing_but_its_own_waiting_counts() {
    let cup = Official::start();
    let token = cup.team("patient");
    cup.open();
    let (mut client, _, _) = cup.playing(&token).await;
    client.goes_on(0).await;
    let refunded_s = async |client: &mut Client| {
        let time = client.ask(json!({"op": "time"})).await;
        time["refunded_s"].as_f64().expect("a number")
    };
    // The first `stop` fails. The team waits before the second one.
    let (mut holder, begun) = (hold(&cup.server).await, Instant::now());
    client.refused(json!({"op": "stop"}), "internal").await;
    let mut answering_s = begun.elapsed().as_secs_f64();
    holder.close().await.expect("unlocks");
    tokio::time::sleep(Duration::from_secs(3)).await;
    let begun = Instant::now();
    assert_eq!(client.ask(json!({"op": "stop"})).await["op"], "result");
    answering_s += begun.elapsed().as_secs_f64();
    let refund_s = refunded_s(&mut client).await;
    assert!((4.0..=answering_s).contains(&refund_s), "{refund_s} of {answering_s} s");

    // Requests that succeed late.
    for request in [official_reset(), json!({"op": "stop"})] {
        let before_s = refunded_s(&mut client).await;
        holder = hold(&cup.server).await;
        let unlock = async {
            tokio::time::sleep(Duration::from_secs(3)).await;
            holder.close().await.expect("unlocks");
        };
        let (done, ()) = tokio::join!(client.ask(request), unlock);
        assert!(done["op"] == "result" || done["op"] == "obs", "{done}");
        let refund_s = refunded_s(&mut client).await - before_s;
        assert!(refund_s > 2.0, "{refund_s} s: {done}");
    }
}

#[tokio::test]
async fn a_run_that_cannot_be_stored_leaves_its_number_to_the_next() {
    let cup = Official::start();
    let token = cup.team("patient");
    cup.open();
    let (mut client, _) = cup.greet(&token).await;
    let options = SqliteConnectOptions::new().filename(cup.server.database());
    let mut database = options.connect().await.expect("opens");
    let trigger = "CREATE TRIGGER trouble BEFORE INSERT ON runs BEGIN SELECT RAISE(ABORT, 'trouble'); END";
    sqlx::query(trigger).execute(&mut database).await.expect("takes it");
    for _ in 0..2 {
        client.refused(official_reset(), "internal").await;
    }
    sqlx::query("DROP TRIGGER trouble").execute(&mut database).await.expect("takes it");

    let obs = client.settled(official_reset()).await;
    let path = format!("/v1/runs/{}", obs["run_id"].as_str().expect("an id"));
    assert_eq!(cup.get(&path, &cup.organizer).json()["k"], 1, "no part of the scene was shown");
}

#[tokio::test]
async fn a_result_that_cannot_be_stored_is_tried_once_for_each_request() {
    let server = Server::start();
    let mut client = Client::connect(&server).await;
    client.ask(json!({"op": "hello", "client": "timed", "session_s": 30.0})).await;
    client.ask(reset()).await;
    let steps = |tick: u32| json!({"op": "step", "tick": tick, "action": {}, "repeat": 100});
    for tick in (0..2900).step_by(100) {
        client.ask(steps(tick)).await;
    }
    let holder = hold(&server).await;
    let begun = Instant::now();
    // It spends the last of the session, and closes the run.
    let last = client.ask(steps(2900)).await;
    let waited_s = begun.elapsed().as_secs_f64();
    holder.close().await.expect("unlocks");
    assert_eq!(last["reason"], "session_over", "{last}");
    // The server waits for five seconds for a database that is locked.
    assert!((4.0..8.0).contains(&waited_s), "{waited_s} s");
    assert_eq!(client.ask(json!({"op": "stop"})).await["ticks"], 3000);
}
