//! The store with real databases: every test runs on each kind.

mod competition;
mod fence;
mod fleet_database;
mod leaderboard;
mod migrations;
mod places;
#[path = "../../../../tests/system/harness/postgres.rs"]
mod postgres;
mod run_actions;
mod similar_runs;
mod transaction;
mod verification;

use super::*;
use palmares_tasks::{Event, Outcome, Reason, Sensing};
use places::places;
use std::time::Duration;

/// A session of this process since it began.
fn held(session_id: &str) -> Held {
    Held::new(session_id.into(), FIRST_EPOCH)
}

/// Takes over all open sessions, as a server does at its start, and aborts their runs, which it returns.
async fn take_over(store: &Store) -> Vec<String> {
    store.end_lost_practice().await.expect("ends");
    let mut taken = store.take_ended_sessions().await.expect("takes");
    taken.extend(store.take_sessions(usize::MAX, None).await.expect("takes"));
    let mut aborted = Vec::new();
    for held in taken {
        aborted.extend(store.abort_open_runs(&held).await.expect("aborts"));
    }
    aborted
}

async fn begin(store: &Store, team: &str, task: &str, run_id: &str) {
    begin_in(store, "practice", team, task, run_id, None, Sensing::Truth).await;
}

async fn begin_in(
    store: &Store,
    mode: &'static str,
    team: &str,
    task: &str,
    run_id: &str,
    k: Option<u64>,
    sensing: Sensing,
) {
    let session_id = format!("s-{run_id}");
    let session = NewSession {
        session_id: session_id.clone(),
        team: team.into(),
        client_version: None,
        limit_s: None,
        mode,
        token_hash: Some("cd".repeat(32)),
    };
    assert!(store.begin_session(&session, None).await.expect("session"));
    store
        .begin_run(
            &held(&session_id),
            &NewRun {
                run_id: run_id.into(),
                team: team.into(),
                task: task.into(),
                hand: "softhand".into(),
                hand_sha256: None,
                mode: "lockstep",
                sensing,
                seed_hex: "00".repeat(32),
                seed: Some(7),
                k,
                server_version: "0".into(),
                build_hash: "0".into(),
                header: None,
            },
        )
        .await
        .expect("run");
}

fn outcome(score: f64) -> Outcome {
    Outcome {
        score,
        in_goal: 1,
        outside: 0,
        reason: Reason::Stopped,
        fault: None,
        ticks: 3,
        sim_time_s: 0.03,
        events: vec![Event { tick: 2, kind: "in_goal".into(), object: Some(4) }],
        state_hash: "0123456789abcdef".into(),
    }
}

async fn finish(store: &Store, run_id: &str, score: f64, status: &str) -> String {
    finish_with(store, run_id, score, status, None).await
}

async fn finish_with(
    store: &Store,
    run_id: &str,
    score: f64,
    status: &str,
    replay: Option<(&str, &str)>,
) -> String {
    let outcome = outcome(score);
    let cost_s = (1.5, 3.25);
    let run = FinishedRunRow {
        held: &held(&format!("s-{run_id}")),
        replay,
        ended_unix_ms: None,
        run_id,
        status,
        outcome: &outcome,
        note: None,
        missed_ticks: 0,
        cost_s,
        clock: None,
    };
    store.finish_run(&run).await.expect("finish")
}

/// A verdict on a run, whether it is the run's turn or not.
async fn judge(store: &Store, run_id: &str, status: VerificationStatus) {
    let claim = sqlx::query("UPDATE runs SET verify_owner = 'judge' WHERE run_id = $1").bind(run_id);
    claim.execute(&store.pool()).await.expect("claims");
    store.set_verdict("judge", run_id, status, "").await.expect("judges");
}

#[tokio::test]
async fn rows_are_there_after_reopening() {
    for place in places().await {
        let store = place.open().await;
        begin(&store, "a", "balls", "done").await;
        begin(&store, "a", "balls", "lost").await;
        finish(&store, "done", 2.5, "practice").await;
        store.close().await;

        let store = place.open().await;
        assert_eq!(take_over(&store).await, ["lost"]);
        assert!(take_over(&store).await.is_empty());
        let done = serde_json::to_value(store.run("done").await.expect("query")).expect("json");
        assert_eq!(done["score"], 2.5);
        assert_eq!(done["reason"], "stopped");
        assert_eq!(done["events"][0]["object"], 4);
        let lost = serde_json::to_value(store.run("lost").await.expect("query")).expect("json");
        assert_eq!(lost["status"], "aborted");
        assert_eq!(lost["score"], serde_json::Value::Null);
        assert!(store.run("never").await.expect("query").is_none());
        store.close().await;
    }
}

#[tokio::test]
async fn a_finished_run_is_not_rewritten() {
    for place in places().await {
        let store = place.open().await;
        begin(&store, "a", "balls", "r").await;
        finish(&store, "r", 1.0, "practice").await;
        finish(&store, "r", 9.0, "practice").await;
        assert_eq!(store.leaderboard(false).await.expect("query")[0].total, 1.0);
        store.close().await;
    }
}

#[tokio::test]
async fn the_best_of_each_task_counts_and_of_ties_the_earlier_is_first() {
    for place in places().await {
        let store = place.open().await;
        let runs = [
            ("late", "balls", 3.0),
            ("early", "balls", 1.0),
            ("early", "balls", 4.0),
            ("early", "shelf", 5.0),
            ("late", "shelf", 6.0),
            ("late", "balls", 2.0),
            ("third", "shelf", -0.5),
        ];
        for (i, (team, task, score)) in runs.into_iter().enumerate() {
            let run_id = format!("r{i}");
            begin(&store, team, task, &run_id).await;
            // Two ends in the same millisecond would be a tie in time as well.
            tokio::time::sleep(Duration::from_millis(3)).await;
            finish(&store, &run_id, score, "practice").await;
        }
        begin(&store, "third", "balls", "voided").await;
        finish(&store, "voided", 100.0, "voided").await;

        let rows = store.leaderboard(false).await.expect("query");
        let short: Vec<_> = rows.iter().map(|r| (r.rank, r.team.as_str(), r.total, r.runs)).collect();
        assert_eq!(short, [(1, "early", 9.0, 3), (2, "late", 9.0, 3), (3, "third", -0.5, 1)]);
        assert_eq!(rows[0].tasks["balls"].run_id, "r2");
        assert!(
            store.leaderboard(true).await.expect("query").is_empty(),
            "practice does not count officially"
        );
        store.close().await;
    }
}

#[tokio::test]
async fn a_database_has_one_server() {
    for place in places().await {
        let store = place.open().await;
        let renewing = async {
            let mut connection = store.connection().await.expect("a connection");
            loop {
                let renewal = Renewal { places: 4, taken: 1, ..Renewal::default() };
                assert!(store.renew(&mut connection, renewal).await.is_ok());
                tokio::time::sleep(Duration::from_millis(200)).await;
            }
        };
        let another = Host::alone();
        let error = tokio::select! {
            opened = Store::open(place.location(), &another) => opened.expect_err("taken").to_string(),
            () = renewing => String::new(),
        };
        assert!(error.contains("in use by another server"), "{error}");
        store.close().await;
        place.open().await.close().await;
    }
}

#[tokio::test]
async fn a_database_of_a_newer_version_is_refused() {
    for place in places().await {
        let store = place.open().await;
        let later = "INSERT INTO _sqlx_migrations (version, description, installed_on, success, checksum, execution_time) \
                     SELECT 999, description, installed_on, success, checksum, execution_time FROM _sqlx_migrations \
                     WHERE version = 1";
        sqlx::query(later).execute(&store.pool()).await.expect("one more migration");
        store.close().await;
        let error = Store::open(place.location(), &Host::alone()).await.expect_err("newer").to_string();
        assert!(error.contains("999"), "{error}");
    }
}

#[tokio::test]
async fn a_successor_waits_until_the_lock_is_released() {
    for place in places().await {
        let store = place.open().await;
        let (successor, ()) = tokio::join!(place.open(), async {
            tokio::time::sleep(Duration::from_millis(300)).await;
            store.close().await;
        });
        successor.close().await;
    }
}

#[tokio::test]
async fn a_missing_database_is_refused_without_showing_the_password() {
    for (url, why) in [
        ("mysql://me:secret@host/db", "this kind of database is not supported"),
        ("sqlite::memory:", "in memory"),
        ("postgres://me:secret@127.0.0.1:1/db", "cannot open the database postgres:…"),
    ] {
        let error = Store::open(&Location::Url(url.to_owned()), &Host::alone())
            .await
            .expect_err("refused")
            .to_string();
        assert!(error.contains(why) && !error.contains("secret"), "{error}");
    }
}
