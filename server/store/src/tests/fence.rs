//! Only the owner of a session writes, also if another owner comes between two statements.

use super::*;
use std::time::Instant;

/// A session of crabs with an open run, and who owns it before and after a take-over by this process.
async fn taken_over(store: &Store) -> (Held, Held) {
    begin_in(store, "official", "crabs", "balls", "r", Some(1), Sensing::Truth).await;
    let taken = store.take_sessions(9, Some("s-r")).await.expect("takes");
    assert_eq!(taken.len(), 1);
    assert_eq!(taken[0].epoch, FIRST_EPOCH + 1);
    (held("s-r"), taken[0].clone())
}

fn entry<'a>(action: &'a str, subject: &'a str) -> NewAuditEntry<'a> {
    NewAuditEntry { actor: "tok_1", action, subject, reason: None }
}

fn new_run(run_id: &str) -> NewRun {
    NewRun {
        run_id: run_id.into(),
        team: "crabs".into(),
        task: "balls".into(),
        hand: "softhand".into(),
        hand_sha256: None,
        mode: "lockstep",
        sensing: Sensing::Truth,
        seed_hex: "00".repeat(32),
        seed: None,
        k: Some(2),
        server_version: "0".into(),
        build_hash: "0".into(),
        header: None,
    }
}

/// Every write of an owner. True if it was done.
async fn write_all(store: &Store, held: &Held) -> Vec<(&'static str, bool)> {
    let clock = ClockRow { started: true, wall_s: 77.0, ..ClockRow::default() };
    let outcome = outcome(9.0);
    let run = FinishedRunRow {
        held,
        ended_unix_ms: None,
        run_id: "r",
        status: "provisional",
        outcome: &outcome,
        note: None,
        missed_ticks: 0,
        cost_s: (1.0, 1.0),
        clock: Some(clock),
        replay: Some(("replays/r.mcap", "ef")),
    };
    let done = |what, done: Result<(), StoreError>| match done {
        Ok(()) => (what, true),
        Err(StoreError::Stale { .. }) => (what, false),
        Err(error) => panic!("{what}: {error}"),
    };
    vec![
        done("save_clock", store.save_clock(held, &clock, &["r".into()]).await),
        done("begin_run", store.begin_run(held, &new_run("r2")).await),
        done("set_resume_token", store.set_resume_token(held, &"ee".repeat(32)).await),
        done("finish_run", store.finish_run(&run).await.map(|_| ())),
        done("abort_open_runs", store.abort_open_runs(held).await.map(|_| ())),
        done("release_session", store.release_session(held).await),
        done("end_session", store.end_session(held).await),
    ]
}

async fn state(store: &Store) -> serde_json::Value {
    let runs = store.runs().await.expect("runs");
    serde_json::json!({ "runs": runs, "session": store.session("s-r").await.expect("session") })
}

async fn enter(store: &Store, phase: CompetitionPhase, action: &str) {
    let change = CompetitionChange::Enter(phase);
    let entry = entry(action, "competition");
    let changed = store.change_competition(change, &entry, |_, _| Ok::<(), ()>(())).await;
    changed.expect("query").expect("may");
}

#[tokio::test]
async fn a_write_of_an_earlier_owner_changes_nothing() {
    for place in places().await {
        let store = place.open().await;
        let (before, after) = taken_over(&store).await;
        let untouched = state(&store).await;
        let stale = write_all(&store, &before).await;
        assert!(stale.iter().all(|(_, done)| !done), "{stale:?}");
        assert!(before.is_lost() && !after.is_lost());
        assert_eq!(state(&store).await, untouched);
        let own = write_all(&store, &after).await;
        assert!(own.iter().all(|(_, done)| *done), "{own:?}");
        assert_ne!(state(&store).await, untouched);
        store.close().await;
    }
}

/// A take-over between the statements of a write waits until the write is whole.
#[tokio::test]
async fn a_take_over_and_a_write_do_not_mix() {
    for place in places().await {
        let store = place.open().await;
        begin_in(&store, "official", "crabs", "balls", "r", Some(1), Sensing::Truth).await;
        let before = held("s-r");
        let transaction = store.fenced(&before).await.expect("the owner's");
        let (other, began) = (store.clone(), Instant::now());
        let taking = tokio::spawn(async move { other.take_sessions(9, Some("s-r")).await });
        tokio::time::sleep(Duration::from_millis(300)).await;
        transaction.commit().await.expect("commits");
        let taken = taking.await.expect("joins").expect("takes");
        // On Postgres a locked session is skipped, and found by the next attempt.
        let taken = match taken.is_empty() {
            true => store.take_sessions(9, Some("s-r")).await.expect("takes"),
            false => {
                assert!(began.elapsed() >= Duration::from_millis(300), "it did not wait");
                taken
            }
        };
        assert_eq!(taken.len(), 1);
        assert!(matches!(store.fenced(&before).await, Err(StoreError::Stale { .. })));
        store.close().await;
    }
}

#[tokio::test]
async fn an_open_run_of_an_ended_session_is_left_to_an_owner_that_is_there() {
    for place in places().await {
        let store = place.open().await;
        for (team, run_id) in [("crabs", "r"), ("eels", "v")] {
            begin_in(&store, "official", team, "balls", run_id, Some(1), Sensing::Truth).await;
        }
        assert!(store.order_end("s-r", &entry("session.end", "s-r")).await.expect("ends"));
        assert!(store.void_session("s-v", &entry("session.void", "s-v")).await.expect("voids"));
        if store.is_shared() {
            assert_eq!(store.take_ended_sessions().await.expect("takes").len(), 0, "their host is there");
            let gone = "UPDATE hosts SET lease_until = 0";
            sqlx::query(gone).execute(&store.pool()).await.expect("ends the lease");
        }
        let taken = store.take_ended_sessions().await.expect("takes");
        assert_eq!(taken.len(), 2, "{taken:?}");
        for held in &taken {
            assert_eq!(store.abort_open_runs(held).await.expect("aborts").len(), 1);
            store.end_session(held).await.expect("gives it up");
        }
        let status = async |run_id| store.run(run_id).await.expect("query").expect("there").status;
        assert_eq!((status("r").await, status("v").await), ("aborted".into(), "voided".into()));
        assert_eq!(store.session("s-v").await.expect("query").map(|s| s.status).as_deref(), Some("voided"));
        // What came too late changes nothing.
        let late = store.fenced(&held("s-r")).await;
        assert!(matches!(late, Err(StoreError::Stale { .. })));
        assert!(store.take_ended_sessions().await.expect("takes").is_empty());
        store.close().await;
    }
}

/// Postgres only: SQLite has one server.
#[tokio::test]
async fn hosts_share_a_database_if_they_fit() {
    let Some(url) = super::postgres::postgres_database().await else {
        return println!("SKIP: no Postgres on this machine");
    };
    let location = Location::Url(url);
    let host = |name: &str, config: &str| Host {
        name: Some(name.into()),
        config_sha256: config.into(),
        ..Host::alone()
    };
    let first = Store::open(&location, &host("h1", "c")).await.expect("the first");
    let second = Store::open(&location, &host("h2", "c")).await.expect("the second");
    for (another, why) in [
        (host("h3", "d"), "whose competition.toml, tasks or hands differ"),
        (host("h2", "c"), "has a host `h2` that runs"),
        (Host::alone(), "only if each has [fleet]"),
    ] {
        let mut renewed = (first.connection().await.expect("one"), second.connection().await.expect("one"));
        let renewing = async {
            loop {
                let renewal = Renewal { places: 4, taken: 1, ..Renewal::default() };
                assert!(first.renew(&mut renewed.0, renewal.clone()).await.expect("renews"));
                assert!(second.renew(&mut renewed.1, renewal).await.expect("renews"));
                tokio::time::sleep(Duration::from_millis(200)).await;
            }
        };
        tokio::select! {
            refused = Store::open(&location, &another) => {
                let error = refused.expect_err("refused").to_string();
                assert!(error.contains(why), "{error}");
            }
            () = renewing => {}
        }
    }
    // A program that would bring the database up to date waits until hosts of the version before are gone.
    let negated = "UPDATE _sqlx_migrations SET version = -version WHERE ABS(version) = \
                   (SELECT MAX(ABS(version)) FROM _sqlx_migrations)";
    let mut connection = first.connection().await.expect("one");
    assert!(first.renew(&mut connection, Renewal::default()).await.expect("renews"));
    sqlx::Executor::execute(&mut connection, negated).await.expect("as before the last migration");
    let error = Store::open(&location, &host("h3", "c")).await.expect_err("refused").to_string();
    assert!(
        error.contains("must be brought up to date, but the host `h1` of an older version uses it"),
        "{error}"
    );
    sqlx::Executor::execute(&mut connection, negated).await.expect("as it was");
    // While the competition is open, its engine is one.
    enter(&first, CompetitionPhase::Open, "competition.open").await;
    let opened = entry("competition.open", "competition");
    let engine = first.change_settings(&[("engine", "0.0.1+another")], &opened).await;
    engine.expect("as if it were opened by another version");
    let error = Store::open(&location, &host("h3", "c")).await.expect_err("refused").to_string();
    assert!(error.contains("open with the engine 0.0.1+another"), "{error}");
    enter(&first, CompetitionPhase::Closed, "competition.close").await;
    // Sessions of a host that lives stay with it, those of one that is gone do not.
    begin_in(&first, "official", "crabs", "balls", "one", Some(1), Sensing::Truth).await;
    begin_in(&second, "official", "eels", "balls", "two", Some(1), Sensing::Truth).await;
    begin_in(&second, "practice", "squids", "balls", "three", None, Sensing::Truth).await;
    assert!(first.take_sessions(9, None).await.expect("takes").is_empty());
    second.close().await;
    assert_eq!(take_over(&first).await, ["three", "two"]);
    // One that has given up its sessions is another owner.
    let mut connection = first.connection().await.expect("one");
    first.renew_incarnation();
    assert!(
        first
            .renew(&mut connection, Renewal { places: 4, ..Renewal::default() })
            .await
            .expect("it is still itself")
    );
    assert_eq!(first.take_sessions(9, None).await.expect("takes").len(), 2);
    // A session whose client is at a host that lives is left to it.
    let second = Store::open(&location, &host("h2", "c")).await.expect("again");
    second.want_session("s-one", true).await.expect("wants");
    let owned = first.owners_of(&mut connection, &[Held::new("s-one".into(), 2)]).await.expect("query");
    assert_eq!((owned[0].epoch, owned[0].wanted.as_deref(), owned[0].firmly), (2, Some("h2"), true));
    first.release_session(&owned[0].held).await.expect("releases");
    assert!(first.take_sessions(9, None).await.expect("takes").is_empty());
    // Without a look at leases, what its owner has given up, and only that.
    assert!(first.take_released("s-one").await.expect("takes").is_none(), "another host wants it");
    assert!(second.take_released("s-one").await.expect("takes").is_some());
    assert!(second.take_released("s-one").await.expect("takes").is_none(), "it has an owner");
    assert!(second.take_released("s-three").await.expect("takes").is_none(), "practice");
    // A process that was replaced finds out.
    let third = host("h1", "c");
    sqlx::query("UPDATE hosts SET lease_until = 0 WHERE host_id = 'h1'")
        .execute(&first.pool())
        .await
        .expect("ends");
    let successor = Store::open(&location, &third).await.expect("the lease has ended");
    assert!(!first.renew(&mut connection, Renewal { places: 4, ..Renewal::default() }).await.expect("query"));
    for store in [first, second, successor] {
        store.close().await;
    }
}
