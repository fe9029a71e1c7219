//! Ticks of runs whose sessions change owners all the time.

use super::begin;
use super::fleet_database::FleetDatabase;
use crate::{Held, OwnedRun, SentSnapshot, SentTicks, Store};
use sqlx::Executor;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

const SESSIONS: usize = 4;
const TAKE_OVERS: u64 = 60;

fn owned(session: usize, epoch: i64) -> OwnedRun {
    OwnedRun { run_id: format!("r{session}"), held: Held::new(format!("s{session}"), epoch) }
}

/// Takes over a session while others write. Returns the epoch and the last tick that is stored then.
async fn take_over(database: &FleetDatabase, store: &Store, session: usize) -> (i64, u64) {
    let take_over = database.take_over_without_commit(&format!("s{session}")).await;
    // Statements that begin now see the earlier epoch.
    tokio::time::sleep(std::time::Duration::from_millis(2)).await;
    let epoch = take_over.commit().await;
    let rows = store.shipped_run(&format!("r{session}")).await.expect("query").ticks;
    (epoch, rows.last().map_or(0, |row| (row.from_tick + row.ticks).unsigned_abs()))
}

#[tokio::test]
async fn no_tick_of_an_earlier_owner_follows_those_of_the_next() {
    let Some(database) = FleetDatabase::new().await else { return };
    let database = Arc::new(database);
    let store = database.open().await;
    for session in 0..SESSIONS {
        database.session(&format!("s{session}"), 0).await;
    }
    // A statement sees the database as it was before the wait; only a lock shows it the present epoch.
    database
        .execute(
            "CREATE FUNCTION wait() RETURNS trigger LANGUAGE plpgsql AS \
             'BEGIN PERFORM pg_sleep(0.004); RETURN NULL; END'; \
             CREATE TRIGGER wait BEFORE INSERT ON run_actions FOR EACH STATEMENT EXECUTE FUNCTION wait()",
        )
        .await;
    let (taken, refused) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    // By session: the epochs with the last tick that they began with, and all confirmed statements.
    type Begun = Mutex<Vec<(usize, i64, u64)>>;
    let (begun, confirmed) = (Arc::new(Begun::default()), Arc::new(Begun::default()));
    let mut writers = Vec::new();
    for writer in 0..3_usize {
        let (database, store, taken, refused) =
            (database.clone(), store.clone(), taken.clone(), refused.clone());
        let (begun, confirmed) = (begun.clone(), confirmed.clone());
        writers.push(tokio::spawn(async move {
            let mut connection = store.shipping_connection().await.expect("connects");
            // By session: the epoch, and the next tick.
            let mut owns: Vec<Option<(i64, u64)>> = vec![None; SESSIONS];
            for round in 0_usize.. {
                let all = taken.load(Ordering::Relaxed);
                if all >= TAKE_OVERS {
                    break;
                }
                // The others do not notice until their next statement.
                if round % 3 == writer {
                    let session = (round / 3 + writer) % SESSIONS;
                    let (epoch, tick) = take_over(&database, &store, session).await;
                    begun.lock().expect("whole").push((session, epoch, tick));
                    owns[session] = Some((epoch, tick));
                    taken.fetch_add(1, Ordering::Relaxed);
                }
                let runs = owns.iter().enumerate();
                let runs = runs.filter_map(|(session, own)| own.map(|(epoch, tick)| (session, epoch, tick)));
                let sent: Vec<SentTicks> = runs
                    .map(|(session, epoch, tick)| {
                        let run = owned(session, epoch);
                        SentTicks { run, from_tick: tick, ticks: 3, body: vec![writer as u8; 40] }
                    })
                    .collect();
                if sent.is_empty() {
                    continue;
                }
                let stored = connection.store_ticks(&sent).await.expect("stores");
                for session in 0..SESSIONS {
                    match &mut owns[session] {
                        Some((epoch, tick)) if stored.contains(&format!("r{session}")) => {
                            confirmed.lock().expect("whole").push((session, *epoch, *tick));
                            *tick += 3;
                        }
                        Some(_) => {
                            refused.fetch_add(1, Ordering::Relaxed);
                            owns[session] = None;
                        }
                        None => {}
                    }
                }
            }
        }));
    }
    for writer in writers {
        writer.await.expect("no panic");
    }
    assert!(refused.load(Ordering::Relaxed) > 0, "owners change while others write");
    let mut connection = database.connect().await;
    for session in 0..SESSIONS {
        let sql = "SELECT from_tick, ticks, epoch FROM run_actions WHERE run_id = $1 ORDER BY from_tick";
        let query = sqlx::query_as(sql).bind(format!("r{session}"));
        let rows: Vec<(i64, i64, i64)> = query.fetch_all(&mut connection).await.expect("query");
        let (mut next, mut last) = (0, 0);
        for (from_tick, ticks, epoch) in rows {
            assert_eq!(from_tick, next, "a gap");
            assert!(epoch >= last, "epoch {epoch} after {last}");
            (next, last) = (from_tick + ticks, epoch);
        }
        assert!(next > 0);
    }
    store.close().await;
    let (begun, confirmed) = (begun.lock().expect("whole"), confirmed.lock().expect("whole"));
    for (session, epoch, tick) in begun.iter() {
        let stale =
            |(of, earlier, from): &&(usize, i64, u64)| of == session && earlier < epoch && from >= tick;
        assert_eq!(confirmed.iter().find(stale), None, "epoch {epoch} of session {session} begins at {tick}");
    }
}

#[tokio::test]
async fn a_statement_again_changes_nothing_and_snapshots_have_the_same_fence() {
    let Some(database) = FleetDatabase::new().await else { return };
    let store = database.open().await;
    database.session("s0", 4).await;
    let mut connection = store.shipping_connection().await.expect("connects");
    let sent = |epoch| SentTicks { run: owned(0, epoch), from_tick: 0, ticks: 2, body: b"ticks".to_vec() };
    let snapshot =
        |epoch, tick, body: &[u8]| SentSnapshot { run: owned(0, epoch), tick, body: body.to_vec() };
    for _ in 0..2 {
        assert_eq!(connection.store_ticks(&[sent(4)]).await.expect("stores").len(), 1);
    }
    for (tick, body) in [(1, b"one"), (2, b"two")] {
        let stored = connection.store_snapshots(&[snapshot(4, tick, body)]).await.expect("stores");
        assert_eq!(stored.into_iter().collect::<Vec<_>>(), ["r0"]);
    }
    for epoch in [3, 5] {
        let changed = SentTicks { body: b"other".to_vec(), ..sent(epoch) };
        assert!(connection.store_ticks(&[changed]).await.expect("answers").is_empty());
        assert!(
            connection.store_snapshots(&[snapshot(epoch, 9, b"nine")]).await.expect("answers").is_empty()
        );
    }
    let run = store.shipped_run("r0").await.expect("query");
    assert_eq!(run.ticks.iter().map(|row| row.body.as_slice()).collect::<Vec<_>>(), [b"ticks"]);
    assert_eq!(run.snapshot.as_deref(), Some(b"two".as_slice()));

    // A statement that waits for a lock is given up, and its connection with it.
    let mut other = database.connect().await;
    other.execute("BEGIN; LOCK TABLE run_actions IN ACCESS EXCLUSIVE MODE").await.expect("locks");
    let begun = std::time::Instant::now();
    assert!(connection.store_ticks(&[sent(4)]).await.is_err());
    assert!(begun.elapsed() < std::time::Duration::from_secs(5));
    other.execute("ROLLBACK").await.expect("unlocks");
    store.close().await;
}

#[tokio::test]
async fn ticks_stay_until_the_replay_is_in_safety() {
    for place in super::places::places().await {
        let store = place.open().await;
        // Its status, whether it has a replay, and whether its ticks stay with a shared storage and without.
        let runs = [
            ("open", false, true, true),
            ("practice", false, false, false),
            ("provisional", true, true, true),
            ("verified", true, true, false),
            ("voided", true, false, false),
        ];
        for (shared, stored) in [(true, false), (false, false), (true, true)] {
            for (status, replay, _, _) in runs {
                let run_id = format!("{status}-{shared}-{stored}");
                begin(&store, "crabs", "balls", &run_id).await;
                for (table, numbers) in [
                    ("run_actions (run_id, from_tick, ticks, epoch, body)", "0, 10, 1"),
                    ("run_snapshots (run_id, tick, epoch, body)", "10, 1"),
                ] {
                    let sql = format!("INSERT INTO {table} VALUES ($1, {numbers}, $2)");
                    let query = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(&run_id).bind(vec![7_u8]);
                    query.execute(&store.pool()).await.expect("inserts");
                }
                if status != "open" {
                    let replay = replay.then_some(("replays/r.mcap", "ef"));
                    super::finish_with(&store, &run_id, 1.0, status, replay).await;
                }
                if stored {
                    store.replay_stored(&run_id, "ef").await.expect("stored");
                }
            }
            store.sweep_shipped_runs(shared).await.expect("sweeps");
            for (status, replay, with, without) in runs {
                let kept = if shared { with } else { without } && !(stored && replay);
                let run = store.shipped_run(&format!("{status}-{shared}-{stored}")).await.expect("query");
                assert_eq!(!run.ticks.is_empty(), kept, "{status}, shared {shared}, stored {stored}");
                assert_eq!(run.snapshot.is_some(), status == "open", "{status}");
            }
        }
        store.close().await;
    }
}
