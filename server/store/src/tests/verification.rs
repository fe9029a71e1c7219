//! Claims on verifications, and verdicts.

use super::*;

/// An official run that waits for its verification.
async fn waiting(store: &Store, team: &str, run_id: &str) {
    begin_in(store, "official", team, "balls", run_id, Some(1), Sensing::Sensors).await;
    finish(store, run_id, 2.0, "provisional").await;
    store.set_replay(run_id, &format!("replays/{run_id}.mcap"), "ef").await.expect("notes");
}

async fn claimed(store: &Store, owner: &str) -> Option<String> {
    store.claim_verification(owner).await.expect("claims").map(|claim| claim.run_id)
}

async fn state(store: &Store, run_id: &str) -> (String, Option<String>) {
    let record = serde_json::to_value(store.run(run_id).await.expect("query")).expect("JSON");
    let text = |field: &str| record[field].as_str().map(str::to_owned);
    (text("status").expect("a status"), text("verify_state"))
}

async fn reverify(store: &Store, run_id: &str) {
    let entry = NewAuditEntry { actor: "test", action: "run.reverify", subject: run_id, reason: None };
    assert!(store.reverify(run_id, &entry).await.expect("orders"));
}

#[tokio::test]
async fn a_run_is_claimed_once() {
    for place in places().await {
        let store = place.open().await;
        let runs: Vec<String> = (0..12).map(|i| format!("run_{i:x}")).collect();
        for run_id in &runs {
            waiting(&store, run_id, run_id).await;
        }
        let mut tasks = tokio::task::JoinSet::new();
        for owner in ["a", "b", "c"] {
            let store = store.clone();
            tasks.spawn(async move {
                let mut all = Vec::new();
                // Postgres skips rows that others have locked, so that none at all may be free for a moment.
                for _ in 0..12 {
                    all.extend(claimed(&store, owner).await);
                }
                all
            });
        }
        let mut all: Vec<String> = tasks.join_all().await.concat();
        all.extend(claimed(&store, "d").await);
        all.sort();
        let mut expected = runs.clone();
        expected.sort();
        assert_eq!(all, expected);
        let queue = store.verification_queue().await.expect("query");
        assert_eq!((queue.waiting, queue.stuck), (12, 0));
        store.close().await;
    }
}

#[tokio::test]
async fn only_the_owner_of_a_claim_decides() {
    let verified = VerificationStatus::Verified;
    for place in places().await {
        let store = place.open().await;
        waiting(&store, "crabs", "r").await;
        assert_eq!(claimed(&store, "a").await.as_deref(), Some("r"));
        assert_eq!(claimed(&store, "b").await, None);
        assert!(!store.set_verdict("b", "r", verified, "").await.expect("query"));
        assert!(!store.renew_claim("b", "r").await.expect("query"));
        assert!(store.renew_claim("a", "r").await.expect("query"));
        // An order takes the claim away: the file may be another one now.
        reverify(&store, "r").await;
        assert!(!store.set_verdict("a", "r", verified, "").await.expect("query"));
        assert!(!store.set_inconclusive("a", "r", "missing_file", Duration::ZERO).await.expect("query"));
        // So does a stop.
        assert_eq!(claimed(&store, "a").await.as_deref(), Some("r"));
        store.release_claims("a").await.expect("query");
        assert_eq!(claimed(&store, "b").await.as_deref(), Some("r"));
        assert_eq!(state(&store, "r").await, ("provisional".into(), Some("waiting".into())));
        assert!(store.set_verdict("b", "r", verified, "").await.expect("query"));
        assert_eq!(state(&store, "r").await, ("verified".into(), None));
        assert_eq!(claimed(&store, "b").await, None);
        store.close().await;
    }
}

#[tokio::test]
async fn a_replay_of_another_host_is_claimed_once_it_is_shared() {
    for place in places().await {
        let store = place.open().await;
        waiting(&store, "crabs", "r").await;
        for (column, value, claimable) in [
            ("replay_host", "'h9'", false),
            ("replay_stored_at", "1", true),
            ("engine", "'0.0.1+another'", false),
        ] {
            let change =
                format!("UPDATE runs SET {column} = {value}, verify_owner = NULL, verify_until = NULL");
            sqlx::query(sqlx::AssertSqlSafe(change)).execute(&store.pool()).await.expect("changes");
            assert_eq!(claimed(&store, "a").await.is_some(), claimable, "{column}");
        }
        store.note_other_engines().await.expect("notes");
        let record = serde_json::to_value(store.run("r").await.expect("query")).expect("JSON");
        let problem = record["verify_problem"].as_str().expect("why");
        assert!(problem.contains("recorded by engine 0.0.1+another"), "{problem}");
        assert_eq!(record["verify_state"], "stuck", "no host has that engine");
        let queue = store.verification_queue().await.expect("query");
        assert_eq!((queue.waiting, queue.stuck), (0, 1));
        store.close().await;
    }
}

#[tokio::test]
async fn tries_without_a_verdict_are_bounded() {
    for place in places().await {
        let store = place.open().await;
        waiting(&store, "crabs", "r").await;
        for tries in 1..=MAX_TRIES {
            let claim = loop {
                if let Some(claim) = store.claim_verification("a").await.expect("claims") {
                    break claim;
                }
            };
            assert_eq!((claim.tries, claim.status.as_str()), (tries, "provisional"));
            assert_eq!(state(&store, "r").await, ("provisional".into(), Some("waiting".into())));
            let (run_id, problem) = (&claim.run_id, "missing_file: gone");
            assert!(store.set_inconclusive("a", run_id, problem, Duration::ZERO).await.expect("query"));
            // From the third try on somebody has to look.
            let queue = store.verification_queue().await.expect("query");
            let (word, counts) = if tries < 3 { ("waiting", (1, 0)) } else { ("stuck", (0, 1)) };
            assert_eq!(state(&store, "r").await.1.as_deref(), Some(word), "{tries}");
            assert_eq!((queue.waiting, queue.stuck), counts, "{tries}");
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
        assert_eq!(claimed(&store, "a").await, None);
        assert_eq!(state(&store, "r").await, ("provisional".into(), Some("stuck".into())));
        let queue = store.verification_queue().await.expect("query");
        assert_eq!((queue.waiting, queue.stuck, queue.oldest()), (0, 1, Duration::ZERO));
        reverify(&store, "r").await;
        // A pause keeps everybody away.
        assert_eq!(claimed(&store, "a").await.as_deref(), Some("r"));
        let pause = Duration::from_secs(600);
        assert!(store.set_inconclusive("a", "r", "missing_file: gone", pause).await.expect("query"));
        assert_eq!(claimed(&store, "b").await, None);
        store.close().await;
    }
}
