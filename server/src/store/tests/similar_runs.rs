//! Fingerprints of runs in both kinds of database.

use super::*;
use crate::fingerprint::{Fingerprint, Mark};
use crate::store::similar_runs::{MAX_PARTNERS, MAX_TEAMS};
use serde_json::{Value, json};

/// A fingerprint of `changes` changes, with a mark at every tenth, hashes from `first` on.
fn marks(first: i64, changes: u64) -> Fingerprint {
    parts(&[(first, changes)])
}

/// A fingerprint of stretches: the first hash and the number of changes of each.
fn parts(parts: &[(i64, u64)]) -> Fingerprint {
    let mut fingerprint = Fingerprint::default();
    for (first, changes) in parts {
        let begin = fingerprint.changes.cast_signed();
        let places = (0..changes.cast_signed()).step_by(10);
        fingerprint.marks.extend(places.map(|place| Mark { hash: first + place, place: begin + place }));
        fingerprint.changes += changes;
    }
    fingerprint
}

/// An official run with this fingerprint. `run_id` is made from team, task and k.
async fn play(store: &Store, team: &str, task: &str, k: u64, fingerprint: &Fingerprint) -> String {
    let run_id = format!("{team}_{task}_{k}");
    begin_in(store, "official", team, task, &run_id, Some(k), Sensing::Truth).await;
    store.compare_actions(&run_id, fingerprint).await.expect("compares");
    run_id
}

/// The runs that are similar to a run: team, k and changes.
async fn similar(store: &Store, run_id: &str) -> Vec<(String, u64, u64)> {
    let run = serde_json::to_value(store.run(run_id).await.expect("query").expect("there")).expect("json");
    let others = run["similar"].as_array().cloned().unwrap_or_default();
    let number = |other: &Value, field: &str| other[field].as_u64().expect("a number");
    let text = |other: &Value| other["team"].as_str().expect("a name").to_owned();
    others.iter().map(|other| (text(other), number(other, "k"), number(other, "changes"))).collect()
}

async fn pairs(store: &Store, team: Option<&str>, task: Option<&str>) -> Vec<Value> {
    let pairs = store.similar_pairs(team, task, 1000).await.expect("query");
    pairs.iter().map(|pair| serde_json::to_value(pair).expect("json")).collect()
}

#[tokio::test]
async fn long_stretches_of_other_teams_in_the_scene_are_found() {
    for place in places().await {
        let store = place.open().await;
        // More marks than one statement takes.
        let whole = marks(1, 9000);
        let first = play(&store, "a", "balls", 2, &whole).await;
        let own = play(&store, "a", "balls", 3, &whole).await;
        let other_k = play(&store, "b", "balls", 1, &whole).await;
        let other_task = play(&store, "b", "shelf", 2, &whole).await;
        let short = play(&store, "c", "balls", 2, &marks(8951, 3000)).await;
        let copy = play(&store, "b", "balls", 2, &marks(1001, 8000)).await;
        store.compare_actions(&copy, &marks(1001, 8000)).await.expect("compares again");
        assert_eq!(similar(&store, &copy).await, [("a".into(), 2, 8006)], "8000 changes from the 1000th on");
        assert_eq!(similar(&store, &first).await, [("b".into(), 2, 8006)]);
        for other in [own, other_k, other_task, short] {
            assert_eq!(similar(&store, &other).await, [], "{other}");
        }
        let all = store.runs().await.expect("query");
        assert_eq!(all.iter().filter(|run| run.similar.is_some()).count(), 2);
        let found = pairs(&store, None, None).await;
        assert_eq!(found.len(), 1);
        assert_eq!(found[0]["runs"][0]["run_id"], json!(first), "the earlier one: {}", found[0]);
        assert_eq!((&found[0]["changes"], &found[0]["of_changes"]), (&json!(8006), &json!(8000)));
        for (team, task, count) in
            [(Some("b"), None, 1), (Some("c"), None, 0), (None, Some("balls"), 1), (None, Some("shelf"), 0)]
        {
            assert_eq!(pairs(&store, team, task).await.len(), count, "{team:?} {task:?}");
        }
        assert!(store.audit(0, 100).await.expect("query").is_empty());
        store.close().await;
    }
}

#[tokio::test]
async fn stretches_of_many_teams_are_not_compared() {
    for place in places().await {
        let store = place.open().await;
        // Every team begins each run with the opening of an example; in scene 3 two teams also have the same actions after it.
        let teams: Vec<String> = (0..12).map(|team| format!("team{team}")).collect();
        for k in 1..=3_u64 {
            for (number, team) in teams.iter().enumerate() {
                let of_its_own = 100_000 * (number as i64 + 1) + 10_000 * k.cast_signed();
                let copied = k == 3 && [7, 11].contains(&number);
                let rest = if copied { 77_000 } else { of_its_own };
                play(&store, team, "balls", k, &parts(&[(1, 500), (rest, 150)])).await;
            }
        }
        let found = pairs(&store, None, None).await;
        // Before the opening was common: each two of the first teams.
        assert_eq!(found.len(), MAX_TEAMS * (MAX_TEAMS - 1) / 2 + 1);
        assert!(found[..found.len() - 1].iter().all(|pair| pair["k"] == 1), "{found:?}");
        let copy = found.last().expect("pairs");
        let runs = [&copy["runs"][0]["run_id"], &copy["runs"][1]["run_id"]];
        assert_eq!(runs, [&json!("team7_balls_3"), &json!("team11_balls_3")]);
        assert_eq!(copy["changes"], 156, "without the opening");
        store.close().await;
    }
}

#[tokio::test]
async fn a_run_keeps_its_longest_matches() {
    for place in places().await {
        let store = place.open().await;
        let stretches: Vec<(i64, u64)> =
            (0..12).map(|team| (10_000 * (team + 1), 200 + 10 * team as u64)).collect();
        for (team, stretch) in stretches.iter().enumerate() {
            play(&store, &format!("team{team:02}"), "balls", 1, &parts(&[*stretch])).await;
        }
        let all = play(&store, "copier", "balls", 1, &parts(&stretches)).await;
        let kept = similar(&store, &all).await;
        assert_eq!(kept.len(), MAX_PARTNERS);
        assert_eq!((kept[0].0.as_str(), kept[7].0.as_str()), ("team11", "team04"));
        assert_eq!(similar(&store, "team11_balls_1").await[0].0, "copier");
        assert_eq!(similar(&store, "team03_balls_1").await, []);
        // The other way round: many runs that each have the one as their longest match.
        let many =
            parts(&stretches.iter().map(|(first, changes)| (first + 500_000, *changes)).collect::<Vec<_>>());
        let one = play(&store, "source", "balls", 2, &many).await;
        for (team, (first, changes)) in stretches.iter().enumerate() {
            play(&store, &format!("team{team:02}"), "balls", 2, &marks(first + 500_000, *changes)).await;
        }
        let kept = similar(&store, &one).await;
        assert_eq!((kept.len(), kept[7].0.as_str()), (MAX_PARTNERS, "team04"));
        assert_eq!(similar(&store, "team00_balls_2").await[0].0, "source");
        assert_eq!(pairs(&store, Some("source"), None).await.len(), 12);
        store.close().await;
    }
}

#[tokio::test]
async fn marks_of_a_backup_of_an_older_version_are_compared() {
    for (old, new) in places().await.into_iter().zip(places().await) {
        let store = old.open().await;
        play(&store, "a", "balls", 2, &marks(1, 3000)).await;
        let mut tables = store.dump().await.expect("dumps");
        store.close().await;
        let (_, rows) = tables.iter_mut().find(|(name, _)| name == "action_marks").expect("marks");
        for row in rows {
            row.remove("k");
        }
        let store = new.open().await;
        store.fill(&tables).await.expect("restores");
        let copy = play(&store, "b", "balls", 2, &marks(1, 3000)).await;
        assert_eq!(similar(&store, &copy).await, [("a".into(), 2, 3006)]);
        store.close().await;
    }
}
