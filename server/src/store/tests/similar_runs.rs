//! Fingerprints of runs in both kinds of database.

use super::*;
use crate::fingerprint::{Fingerprint, Mark};
use serde_json::json;

/// A fingerprint of `changes` changes, with a mark at every tenth, hashes from `first` on.
fn marks(first: i64, changes: u64) -> Fingerprint {
    let places = (0..changes.cast_signed()).step_by(10);
    Fingerprint { changes, marks: places.map(|place| Mark { hash: first + place, place }).collect() }
}

#[tokio::test]
async fn long_stretches_of_other_teams_in_the_task_are_found() {
    for place in places().await {
        let store = place.open().await;
        for (k, (team, task, run_id)) in [
            ("a", "balls", "first"),
            ("b", "balls", "copy"),
            ("a", "balls", "own"),
            ("b", "shelf", "elsewhere"),
            ("c", "balls", "short"),
        ]
        .into_iter()
        .enumerate()
        {
            begin_in(&store, "official", team, task, run_id, Some(k as u64 + 1), Sensing::Truth).await;
        }
        // More marks than one statement takes.
        for (run_id, marks) in [
            ("first", marks(1, 3000)),
            ("own", marks(1, 3000)),
            ("elsewhere", marks(1, 3000)),
            ("short", marks(2951, 3000)),
            ("copy", marks(1001, 2000)),
        ] {
            store.compare_actions(run_id, &marks).await.expect("compares");
            store.compare_actions(run_id, &marks).await.expect("compares again");
        }
        let similar = async |run_id: &str| {
            let run = store.run(run_id).await.expect("query").expect("there");
            serde_json::to_value(run).expect("json").get("similar").cloned()
        };
        let of = |run_id: &str, team: &str, k: u64, changes: u64| json!({"run_id": run_id, "team": team, "k": k, "changes": changes});
        assert_eq!(
            similar("copy").await,
            Some(json!([of("first", "a", 1, 2006), of("own", "a", 3, 2006)])),
            "2000 changes from the 1000th on"
        );
        assert_eq!(similar("first").await, Some(json!([of("copy", "b", 2, 2006)])));
        assert_eq!((similar("elsewhere").await, similar("short").await), (None, None));
        let all = store.runs().await.expect("query");
        assert_eq!(all.iter().filter(|run| run.similar.is_some()).count(), 3);
        let audit = store.audit(0, 100).await.expect("query");
        let reported: Vec<_> =
            audit.iter().filter(|e| e.action == "run.similar").map(|e| e.subject.as_str()).collect();
        assert_eq!(reported, ["copy", "copy"]);
        store.close().await;
    }
}
