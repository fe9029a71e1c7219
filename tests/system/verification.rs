//! Outcomes that are no verdict.

use crate::harness::{Official, get};
use serde_json::json;
use tempfile::TempDir;

#[tokio::test]
async fn a_missing_file_is_no_verdict() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, _, obs) = cup.playing(&token).await;
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 50})).await;
        client.ask(json!({"op": "stop"})).await;
        cup.verified(&obs["run_id"]).await;
        let ranking = get(&cup.server, "/v1/leaderboard").json()["rows"].clone();
        assert_eq!(ranking.as_array().map(Vec::len), Some(1));

        // The same database and keys with another data directory, as after a restored backup without its replays.
        let url = match &cup.database_url {
            Some(url) => url.clone(),
            None => format!("sqlite://{}", cup.server.database().display()),
        };
        let (first, rules) = cup.killed();
        let second = TempDir::new().expect("temporary directory");
        for name in ["signing.key", "seed.secret", "organizer.token"] {
            std::fs::copy(first.path().join(name), second.path().join(name)).expect("copied");
        }
        let cup = Official::start_on(second, &rules, Some(url));
        cup.order("run/reverify", json!({"run_id": obs["run_id"], "reason": "a doubt"}));
        let path = format!("/v1/runs/{}", obs["run_id"].as_str().expect("an id"));
        let run = loop {
            let run = cup.get(&path, &cup.organizer).json();
            if run["verify_problem"].is_string() || run["status"] == "rejected" {
                break run;
            }
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        };
        assert_eq!((&run["status"], &run["verify_state"]), (&json!("verified"), &json!("waiting")), "{run}");
        assert!(run["verify_problem"].as_str().expect("why").starts_with("missing_file"), "{run}");
        assert_eq!(get(&cup.server, "/v1/leaderboard").json()["rows"], ranking);
        assert!(get(&cup.server, "/metrics").body.contains("inconclusive_total{reason=\"missing_file\"} 1"));
        assert!(get(&cup.server, &path).json().get("verify_problem").is_none(), "for organizers only");

        // With the file there is a verdict.
        let (replay, replays) = (obs["run_id"].as_str().expect("an id"), first.path().join("replays"));
        let name = format!("{replay}.mcap");
        let to = cup.server.folder().join("replays").join(&name);
        std::fs::copy(replays.join(&name), to).expect("copied");
        cup.order("run/reverify", json!({"run_id": obs["run_id"], "reason": "the file is back"}));
        cup.verified(&obs["run_id"]).await;
    }
}
