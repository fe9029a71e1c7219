//! Likeness of runs in both kinds of database.

use super::*;
use crate::similar_runs::{MAX_PARTNERS, MAX_TEAMS};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use palmares_replay::likeness::{Likeness, Path};
use serde_json::{Value, json};

/// A path of 30 points at the origin: long enough to be compared.
fn moving() -> Path {
    let bytes = [&10.0_f32.to_le_bytes()[..], &[0; 30 * 22]].concat();
    Path::of_text(&BASE64_STANDARD.encode(bytes)).expect("a path")
}

fn alike(share: f64) -> Likeness {
    Likeness { share, distance_mm: 1.5, shift_s: 0.5, offset_mm: 3.0 }
}

/// An official run that shares these parts with earlier runs of the scene, by run; the default is nothing. `run_id` is made from team,
/// task and k. Returns also the runs with which it was compared.
async fn play(
    store: &Store,
    team: &str,
    task: &str,
    k: u64,
    shares: &[(&str, f64)],
) -> (String, Vec<String>) {
    let run_id = format!("{team}_{task}_{k}");
    begin_in(store, "official", team, task, &run_id, Some(k), Sensing::Truth).await;
    (run_id.clone(), verify(store, &run_id, shares).await)
}

async fn verify(store: &Store, run_id: &str, shares: &[(&str, f64)]) -> Vec<String> {
    let others = store.store_path(run_id, &moving()).await.expect("stored");
    let mut compared: Vec<String> = others.iter().map(|other| other.run_id.clone()).collect();
    compared.sort();
    let share = |run_id: &str| shares.iter().find(|(other, _)| *other == run_id).map(|(_, share)| *share);
    let found =
        others.into_iter().filter_map(|other| share(&other.run_id).map(|share| (other, alike(share))));
    store.store_likeness(run_id, found.collect()).await.expect("stored");
    compared
}

/// The runs that are similar to a run: team and share in percent.
async fn similar(store: &Store, run_id: &str) -> Vec<(String, u64)> {
    let run = serde_json::to_value(store.run(run_id).await.expect("query").expect("there")).expect("json");
    let others = run["similar"].as_array().cloned().unwrap_or_default();
    let percent = |other: &Value| (100.0 * other["share"].as_f64().expect("a number")).round() as u64;
    others.iter().map(|other| (other["team"].as_str().expect("a name").to_owned(), percent(other))).collect()
}

async fn pairs(store: &Store, team: Option<&str>, task: Option<&str>) -> Vec<Value> {
    let pairs = store.similar_pairs(team, task, 1000).await.expect("query");
    pairs.iter().map(|pair| serde_json::to_value(pair).expect("json")).collect()
}

#[tokio::test]
async fn a_run_is_compared_with_other_teams_runs_in_its_scene() {
    for place in places().await {
        let store = place.open().await;
        let (first, _) = play(&store, "a", "balls", 2, &[]).await;
        for (team, task, k) in [("a", "balls", 3), ("b", "balls", 1), ("b", "shelf", 2)] {
            let (_, compared) = play(&store, team, task, k, &[]).await;
            assert!(!compared.contains(&first), "{team} {task} {k}: {compared:?}");
        }
        let (copy, compared) = play(&store, "b", "balls", 2, &[(&first, 0.9)]).await;
        assert_eq!(compared, [first.as_str()]);
        // Verified again, it is found once.
        verify(&store, &copy, &[(&first, 0.8)]).await;
        let (less, compared) = play(&store, "c", "balls", 2, &[(&first, 0.3)]).await;
        assert_eq!(compared, [first.as_str(), copy.as_str()]);
        assert_eq!(similar(&store, &copy).await, [("a".into(), 80)]);
        assert_eq!(similar(&store, &first).await, [("b".into(), 80)]);
        assert_eq!(similar(&store, &less).await, []);
        let all = store.runs().await.expect("query");
        assert_eq!(all.iter().filter(|run| run.similar.is_some()).count(), 2);
        let found = pairs(&store, None, None).await;
        assert_eq!(found.len(), 1);
        assert_eq!(found[0]["runs"][0]["run_id"], json!(first), "the earlier one: {}", found[0]);
        // It was the other run that is 0.5 s later at the same place.
        assert_eq!((&found[0]["shift_s"], &found[0]["distance_mm"]), (&json!(-0.5), &json!(1.5)));
        for (team, task, count) in
            [(Some("b"), None, 1), (Some("c"), None, 0), (None, Some("balls"), 1), (None, Some("shelf"), 0)]
        {
            assert_eq!(pairs(&store, team, task).await.len(), count, "{team:?} {task:?}");
        }
        // Without a path, as a rejected run, it is not compared any more.
        assert!(store.store_path(&copy, &Path::default()).await.expect("stored").is_empty());
        assert_eq!(verify(&store, &less, &[]).await, [first.as_str()]);
        assert!(store.audit(0, 100).await.expect("query").is_empty());
        store.close().await;
    }
}

#[tokio::test]
async fn what_many_teams_share_is_not_listed() {
    for place in places().await {
        let store = place.open().await;
        // Every team plays an example; the last one also has the rest of another team's run.
        let teams: Vec<String> = (0..12).map(|team| format!("team{team:02}")).collect();
        let mut runs: Vec<(String, f64)> = Vec::new();
        for (number, team) in teams.iter().enumerate() {
            let mut shares: Vec<(&str, f64)> =
                runs.iter().map(|(run, share)| (run.as_str(), *share)).collect();
            if number == 11 {
                shares[7].1 = 0.95;
            }
            let (run, _) = play(&store, team, "balls", 1, &shares).await;
            runs.push((run, 0.7));
        }
        let found = pairs(&store, None, None).await;
        // Before the example was common: each two of the first teams.
        assert_eq!(found.len(), MAX_TEAMS * (MAX_TEAMS - 1) / 2 + 1, "{found:?}");
        let runs = [&found[0]["runs"][0]["run_id"], &found[0]["runs"][1]["run_id"]];
        assert_eq!(runs, [&json!("team07_balls_1"), &json!("team11_balls_1")]);
        assert_eq!(found[0]["share"], 0.95);
        store.close().await;
    }
}

#[tokio::test]
async fn a_run_keeps_its_best_pairs() {
    for place in places().await {
        let store = place.open().await;
        // Many runs that each have the one as their only match.
        let (one, _) = play(&store, "source", "balls", 2, &[]).await;
        for team in 0..12 {
            let share = 0.6 + 0.01 * f64::from(team);
            play(&store, &format!("team{team:02}"), "balls", 2, &[(&one, share)]).await;
        }
        let kept = similar(&store, &one).await;
        assert_eq!((kept.len(), kept[0].0.as_str(), kept[7].0.as_str()), (MAX_PARTNERS, "team11", "team04"));
        assert_eq!(similar(&store, "team00_balls_2").await, [("source".into(), 60)]);
        assert_eq!(pairs(&store, Some("source"), None).await.len(), 12);
        store.close().await;
    }
}

#[tokio::test]
async fn paths_are_part_of_a_backup() {
    for (old, new) in places().await.into_iter().zip(places().await) {
        let store = old.open().await;
        let (first, _) = play(&store, "a", "balls", 2, &[]).await;
        play(&store, "b", "balls", 2, &[(&first, 0.9)]).await;
        let mut tables = store.dump().await.expect("dumps");
        store.close().await;
        // Tables of earlier versions are left out.
        tables.push((
            "similar_runs".into(),
            vec![json!({"changes": 1}).as_object().cloned().expect("an object")],
        ));
        let store = new.open().await;
        store.fill(&tables).await.expect("restores");
        assert_eq!(similar(&store, &first).await, [("b".into(), 90)]);
        let (_, compared) = play(&store, "c", "balls", 2, &[]).await;
        assert_eq!(compared.len(), 2);
        store.close().await;
    }
}
