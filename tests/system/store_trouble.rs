//! A database that does not take what it is given: `internal`, and nothing is lost.

use crate::harness::{Client, Official, Server, get, official_reset, reset, step};
use serde_json::json;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{ConnectOptions, Connection};
use std::time::Instant;

/// Another program that holds the database's write lock.
async fn hold(server: &Server) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(server.database());
    let mut holder = options.connect().await.expect("opens");
    sqlx::query("BEGIN IMMEDIATE").execute(&mut holder).await.expect("locks");
    holder
}

#[tokio::test]
async fn a_result_that_cannot_be_stored_is_not_lost_and_not_told() {
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
