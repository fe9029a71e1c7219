//! SIGKILL in the middle of a run: finished runs remain, the open one is marked, the file is whole. And
//! SIGTERM with runs that do not finish in time.

use crate::harness::{Client, Official, Server, get, reset};
use futures_util::future::join_all;
use serde_json::json;
use sqlx::ConnectOptions;
use sqlx::sqlite::SqliteConnectOptions;

#[tokio::test]
async fn after_sigkill_everything_finished_is_there_and_the_open_run_is_marked() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "survivor").await;
    let mut finished = Vec::new();
    for _ in 0..3 {
        assert_eq!(client.ask(reset()).await["op"], "obs");
        client.goes_on(0).await;
        finished.push(client.ask(json!({"op": "stop"})).await);
    }
    let open = client.ask(reset()).await;
    client.goes_on(0).await;
    let rows = get(&server, "/v1/leaderboard").json()["rows"].clone();

    let folder = server.kill();
    let options = SqliteConnectOptions::new().filename(folder.path().join("palmares.sqlite"));
    let mut database = options.connect().await.expect("opens");
    let (verdict,): (String,) =
        sqlx::query_as("PRAGMA integrity_check").fetch_one(&mut database).await.expect("query");
    assert_eq!(verdict, "ok");
    drop(database);

    let server = Server::start_in(folder, &[]);
    for result in finished {
        let run = get(&server, &format!("/v1/runs/{}", result["run_id"].as_str().expect("an id"))).json();
        for field in ["score", "ticks", "state_hash", "reason", "status", "in_goal", "outside", "events"] {
            assert_eq!(run[field], result[field], "{field}: {run}");
        }
    }
    let run_id = open["run_id"].as_str().expect("an id");
    let run = get(&server, &format!("/v1/runs/{run_id}")).json();
    assert_eq!((&run["status"], &run["score"]), (&json!("aborted"), &json!(null)), "{run}");
    assert_eq!(get(&server, "/v1/leaderboard").json()["rows"], rows);
    Client::playing(&server, "survivor").await.0.goes_on(0).await;

    server.signal("TERM");
    let (status, log, _folder) = server.wait();
    assert!(status.success(), "{status}");
    assert!(log.contains(run_id) && log.contains("aborted"), "the marked run is logged:\n{log}");
}

#[tokio::test]
async fn a_server_ends_whatever_its_runs_do_and_says_so() {
    let server = Server::start_with(&["--shutdown-grace-s", "0"]);
    let (mut client, _) = Client::playing(&server, "endless").await;
    client.goes_on(0).await;
    server.signal("TERM");
    let (status, log, folder) = server.wait();
    assert_eq!(status.code(), Some(3), "{status}");
    assert!(log.contains("did not finish in time"), "{log}");
    let server = Server::start_in(folder, &[]);
    assert_eq!(get(&server, "/readyz").status, 200);
}

#[tokio::test]
async fn all_teams_come_back_at_once_after_a_sigkill() {
    let cup = Official::start();
    let teams: Vec<String> = (0..12).map(|k| cup.team(&format!("team {k}"))).collect();
    cup.open();
    let mut playing = join_all(teams.iter().map(|token| cup.playing(token))).await;
    for (client, _, _) in &mut playing {
        client.goes_on(0).await;
    }
    let cup = cup.crashed();
    let after = join_all(teams.iter().map(|token| cup.greet(token))).await;
    for ((_, welcome), (_, before, _)) in after.iter().zip(&playing) {
        assert_eq!(welcome["session_id"], before["session_id"], "{welcome}");
    }
    let runs = cup.get("/v1/admin/export/runs", &cup.organizer).json();
    let aborted = runs.as_array().expect("runs").iter().filter(|run| run["status"] == "aborted").count();
    assert_eq!(aborted, teams.len(), "{runs}");
}
