//! Official clocks over crashes, restarts and backups.

use crate::harness::{Client, Official, RULES, get, official_reset};
use serde_json::{Value, json};
use sqlx::ConnectOptions;
use sqlx::sqlite::SqliteConnectOptions;
use std::time::{Duration, Instant};
use tempfile::TempDir;

async fn elapsed_s(client: &mut Client) -> f64 {
    let time = client.ask(json!({"op": "time"})).await;
    time["elapsed_s"].as_f64().unwrap_or_else(|| panic!("a number: {time}"))
}

/// A team that has finished a run of one tick, in a session that is open.
async fn idle(cup: &Official, token: &str) -> Client {
    let (mut client, _, _) = cup.playing(token).await;
    client.goes_on(0).await;
    assert_eq!(client.ask(json!({"op": "stop"})).await["op"], "result");
    client
}

#[tokio::test]
async fn time_without_a_run_is_in_a_backup_and_outlives_a_crash() {
    for cup in Official::each().await {
        let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
        cup.open();
        let mut idle = idle(&cup, &crabs).await;
        let (mut playing, _, _) = cup.playing(&eels).await;
        playing.goes_on(0).await;
        tokio::time::sleep(Duration::from_secs(2)).await;
        let before_s = elapsed_s(&mut idle).await;
        let out = TempDir::new().expect("temporary directory");
        let archive = out.path().join("cup.zip");
        assert!(cup.admin(&["backup", archive.to_str().expect("a path")]).status.success());
        let after_s = elapsed_s(&mut idle).await;
        let in_backup = backed_up_s(&archive);
        assert!((before_s..=after_s).contains(&in_backup["crabs"]), "{before_s} {in_backup:?} {after_s}");
        // The clock is that before the open run, which would not count.
        assert_eq!(in_backup["eels"], 0.0);

        // While the server is down, no time passes.
        let cup = {
            let database_url = cup.database_url.clone();
            let (folder, rules) = cup.killed();
            tokio::time::sleep(Duration::from_secs(2)).await;
            Official::start_on(folder, &rules, database_url)
        };
        let up = Instant::now();
        let (mut idle, _) = cup.greet(&crabs).await;
        let restored_s = elapsed_s(&mut idle).await;
        // The server had started a little before its address was known.
        let most_s = after_s + up.elapsed().as_secs_f64() + 1.0;
        assert!((before_s..most_s).contains(&restored_s), "{before_s} {restored_s} {most_s}");
    }
}

#[tokio::test]
async fn the_clock_is_stopped_while_a_team_waits_for_a_place() {
    let rules = format!("{RULES}max_worlds = 1\n");
    let cup = Official::start_on(TempDir::new().expect("temporary directory"), &rules, None);
    let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
    cup.open();
    let mut first = idle(&cup, &crabs).await;
    let (mut second, _, _) = cup.playing(&eels).await;
    // The first team is refused. Until it asks again, its clock does not move.
    let refused = first.refused(official_reset(), "capacity").await;
    assert!(
        refused["message"].as_str().is_some_and(|text| text.contains("0 sessions wait before")),
        "{refused}"
    );
    let stopped_s = elapsed_s(&mut first).await;
    tokio::time::sleep(Duration::from_secs(2)).await;
    first.refused(official_reset(), "capacity").await;
    assert_eq!(elapsed_s(&mut first).await, stopped_s);
    assert!(get(&cup.server, "/metrics").body.contains("palmares_sessions_waiting 1\n"));
    // The second one stops. The free place is for the team that waits.
    second.ask(json!({"op": "stop"})).await;
    let refused = second.refused(official_reset(), "capacity").await;
    assert!(
        refused["message"].as_str().is_some_and(|text| text.contains("1 session waits before")),
        "{refused}"
    );
    let obs = first.settled(official_reset()).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    let played_s = elapsed_s(&mut first).await;
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert!(elapsed_s(&mut first).await > played_s.max(stopped_s), "it runs again");
}

/// Wall-clock time of the teams' sessions in a backup, s.
fn backed_up_s(archive: &std::path::Path) -> std::collections::HashMap<String, f64> {
    let file = std::fs::File::open(archive).expect("opens");
    let mut zip = zip::ZipArchive::new(file).expect("a ZIP archive");
    let table =
        std::io::read_to_string(zip.by_name("tables/sessions.jsonl").expect("a table")).expect("text");
    let row = |line: &str| {
        let row: Value = serde_json::from_str(line).expect("JSON");
        (row["team"].as_str().expect("a team").to_owned(), row["clock_wall_s"].as_f64().expect("a number"))
    };
    table.lines().map(row).collect()
}

#[tokio::test]
async fn the_clocks_are_saved_while_nothing_happens() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let mut client = idle(&cup, &token).await;
    let stopped_s = elapsed_s(&mut client).await;
    drop(client);
    let options = SqliteConnectOptions::new().filename(cup.server.database());
    let mut database = options.connect().await.expect("opens");
    let mut saved_s = 0.0;
    let patience = Instant::now();
    while saved_s <= stopped_s + 1.0 {
        assert!(patience.elapsed() < Duration::from_secs(60), "{saved_s} s are saved");
        tokio::time::sleep(Duration::from_millis(200)).await;
        let query = sqlx::query_scalar("SELECT clock_wall_s FROM sessions");
        saved_s = query.fetch_one(&mut database).await.expect("query");
    }
    drop(database);
    let cup = cup.crashed();
    let (mut client, _) = cup.greet(&token).await;
    assert!(elapsed_s(&mut client).await >= saved_s);
    // A reset that opens no run, and one whose run the next crash ends, do not change it.
    client.refused(json!({"op": "reset", "task": "none", "hand": "softhand"}), "unknown_task").await;
    assert_eq!(client.ask(official_reset()).await["op"], "obs");
    client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 100})).await;
    let in_run_s = elapsed_s(&mut client).await;
    let cup = cup.crashed();
    let (mut client, _) = cup.greet(&token).await;
    let time = client.ask(json!({"op": "time"})).await;
    assert_eq!((time["simulated_s"].as_f64() < Some(1.0), time["run"].is_null()), (true, true), "{time}");
    assert!(time["elapsed_s"].as_f64() > Some(saved_s), "{time} {saved_s} {in_run_s}");
}
