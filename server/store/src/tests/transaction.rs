//! A failed transaction costs the next ones nothing: its connection is closed.

use super::*;
use crate::location::Dialect;
use sqlx::Executor;

fn entry() -> NewAuditEntry<'static> {
    NewAuditEntry { actor: "tok_1", action: "test", subject: "everything", reason: None }
}

/// Writes as often as the pool has connections, and more: each must do.
async fn writes(store: &Store, after: &str) {
    for _ in 0..12 {
        store.record(&entry()).await.unwrap_or_else(|error| panic!("after {after}: {error}"));
    }
    store.dump().await.unwrap_or_else(|error| panic!("a snapshot after {after}: {error}"));
}

#[tokio::test]
async fn a_failure_anywhere_in_a_transaction_leaves_the_next_ones_alone() {
    for place in places().await {
        let store = place.open().await;
        let sqlite = store.dialect == Dialect::Sqlite;
        let late = "CREATE TABLE late (id TEXT PRIMARY KEY, parent TEXT REFERENCES late (id) DEFERRABLE INITIALLY DEFERRED)";
        store.pool().execute(late).await.expect("creates");
        for _ in 0..6 {
            // A statement for which the file has no room: SQLite rolls back by itself.
            if sqlite {
                let mut transaction = store.write().await.expect("begins");
                transaction.execute("PRAGMA max_page_count = 1").await.expect("a limit");
                let large = "INSERT INTO settings (key, value) VALUES ('large', hex(zeroblob(2000000)))";
                let error = transaction.execute(large).await.expect_err("no room").to_string();
                assert!(error.contains("full"), "{error}");
            }
        }
        writes(&store, "a full file").await;
        for _ in 0..6 {
            let mut transaction = store.write().await.expect("begins");
            transaction.execute("INSERT INTO nowhere VALUES (1)").await.expect_err("no such table");
        }
        writes(&store, "a wrong statement").await;
        for _ in 0..6 {
            let mut transaction = store.write().await.expect("begins");
            transaction.execute("INSERT INTO late (id, parent) VALUES ('a', 'nobody')").await.expect("later");
            transaction.commit().await.expect_err("nobody");
        }
        writes(&store, "a commit").await;
        let entry = entry();
        for _ in 0..6 {
            // A future that is dropped at any of its steps.
            for steps in 1..20 {
                let mut writing = Box::pin(store.record(&entry));
                for _ in 0..steps {
                    let polled = futures_util::future::poll_immediate(&mut writing).await;
                    if polled.is_some() {
                        break;
                    }
                    tokio::time::sleep(Duration::from_micros(100)).await;
                }
            }
        }
        writes(&store, "dropped futures").await;
        store.close().await;
    }
}

#[tokio::test]
async fn a_row_that_is_not_stored_is_not_returned() {
    for place in places().await {
        let store = place.open().await;
        if store.dialect == Dialect::Sqlite {
            // The statement's own commit fails, as on a full disk.
            let late = "CREATE TABLE late (id TEXT PRIMARY KEY, parent TEXT REFERENCES late (id) DEFERRABLE INITIALLY DEFERRED)";
            store.pool().execute(late).await.expect("creates");
            for (name, table, when) in
                [("k", "run_counters", "INSERT"), ("claim", "runs", "UPDATE OF verify_owner")]
            {
                let trigger = format!(
                    "CREATE TRIGGER late_{name} AFTER {when} ON {table} BEGIN INSERT INTO late VALUES ('{name}', 'nobody'); END"
                );
                store.pool().execute(sqlx::AssertSqlSafe(trigger)).await.expect("creates");
            }
            assert!(store.next_k("crabs", "balls").await.is_err(), "the number is not stored");
            begin_in(&store, "official", "crabs", "balls", "r", Some(1), Sensing::Sensors).await;
            finish_with(&store, "r", 2.0, "provisional", Some(("replays/r.mcap", "ef"))).await;
            assert!(store.claim_verification("a").await.is_err(), "the claim is not stored");
        }
        store.close().await;
    }
}

#[tokio::test]
async fn a_proof_of_writing_fails_while_nobody_can_write() {
    for place in places().await {
        let store = place.open().await;
        store.prove_writing().await.expect("writes");
        store.prove_writing().await.expect("writes again");
        store.pool().execute("DROP TABLE proofs").await.expect("drops");
        store.prove_writing().await.expect_err("nowhere to write");
        store.close().await;
    }
}
