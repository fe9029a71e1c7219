//! The shipper on a real Postgres.

use super::*;
use crate::fleet::shipped_tick::decode;
use palmares_models::hand::Hand;
use palmares_replay::StateHash;
use palmares_store::{Host, Location};
use palmares_tasks::{Action, BaseTarget, Seed, Task};

#[path = "../../../store/src/tests/fleet_database.rs"]
mod fleet_database;
#[path = "../../../../tests/system/harness/postgres.rs"]
mod postgres;

use fleet_database::FleetDatabase;

/// Ends all connections to a database but one.
async fn end_other_connections(database: &FleetDatabase) {
    let others = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity \
                  WHERE datname = current_database() AND pid <> pg_backend_pid()";
    database.execute(others).await;
}

fn run() -> Run {
    let hand = Hand::builtin("pinch").expect("a hand of the program");
    Run::new(Task::builtin().remove(0), hand, Seed::from_u64(5)).expect("scene")
}

fn step(run: &mut Run) {
    let t = 0.01 * run.tick() as f64;
    let base =
        BaseTarget::Pose { position: [0.1 * t.sin(), 0.0, 0.8 - 0.1 * t], quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
    let hand = Some(vec![(0.3 * t).min(1.0); run.hand().motors.len()]);
    run.step(&Action { base: Some(base), hand, effort: None }).expect("valid");
}

/// Plays to a tick, with an observer.
fn play(run: &mut Run, observer: &mut ShippingObserver, until: u64) {
    while run.tick() < until {
        step(run);
        observer.ticked(&Ticked::of(run));
    }
}

/// The stored ticks of a run: their states, in order.
async fn stored(store: &Store, run_id: &str) -> Vec<StateHash> {
    let mut states = Vec::new();
    for row in store.shipped_run(run_id).await.expect("query").ticks {
        assert_eq!(row.from_tick, states.len() as i64, "a gap, or ticks twice");
        let ticks = decode(&row.body).expect("ticks");
        assert_eq!(row.ticks, ticks.len() as i64);
        states.extend(ticks.into_iter().map(|tick| tick.state));
    }
    states
}

#[tokio::test]
async fn ticks_and_snapshots_of_all_runs_are_stored() {
    let Some(database) = FleetDatabase::new().await else { return };
    let store = database.open().await;
    let shipper = Shipper::start(store.clone()).expect("a thread");
    let mut expected = Vec::new();
    for (name, ticks) in [("a", 230), ("b", 3), ("c", 0)] {
        database.session(name, 1).await;
        let (mut observer, gate) = shipper.follow(name, &Held::new(name.into(), 1));
        let mut run = run();
        observer.opened(&run);
        let mut states = Vec::new();
        while run.tick() < ticks {
            step(&mut run);
            gate.open(run.tick()).await.expect("one owner");
            observer.ticked(&Ticked::of(&run));
            states.push(StateHash::of(&run));
        }
        shipper.flush(name).await.expect("one owner");
        assert_eq!(gate.stored(), ticks);
        expected.push((name, states, observer));
    }
    for (name, states, _) in &expected {
        assert_eq!(&stored(&store, name).await, states);
    }
    let snapshot = store.shipped_run("a").await.expect("query").snapshot.expect("two seconds of ticks");
    let snapshot = Snapshot::from_bytes(&snapshot).expect("a snapshot").tick();
    assert!((100..=230).contains(&snapshot), "{snapshot}");
    assert_eq!(store.shipped_run("b").await.expect("query").snapshot, None);

    // After the end of a run its rows can be deleted, and stay so.
    let (_, _, observer) = expected.swap_remove(0);
    drop(observer);
    shipper.forget("a", &Held::new("a".into(), 1)).await;
    store.delete_shipped_run("a").await.expect("deletes");
    shipper.flush("b").await.expect("one owner");
    assert_eq!(store.shipped_run("a").await.expect("query"), palmares_store::ShippedRun::default());
    drop(expected);
    while !shipper.shared.runs.lock().is_empty() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    store.close().await;
}

#[tokio::test]
async fn while_the_database_fails_the_gate_closes_and_afterwards_no_tick_is_missing() {
    let Some(database) = FleetDatabase::new().await else { return };
    let store = database.open().await;
    let shipper = Shipper::start(store.clone()).expect("a thread");
    database.session("s", 1).await;
    let (mut observer, gate) = shipper.follow("r", &Held::new("s".into(), 1));
    let mut run = run();
    observer.opened(&run);
    play(&mut run, &mut observer, 20);
    shipper.flush("r").await.expect("one owner");
    // A lost connection alone is not noticed.
    end_other_connections(&database).await;
    play(&mut run, &mut observer, 40);
    shipper.flush("r").await.expect("one owner");
    database.execute("ALTER TABLE run_actions RENAME TO away").await;
    play(&mut run, &mut observer, 65);
    assert!(gate.may_show(65) && !gate.may_show(66));
    let waiting = tokio::spawn({
        let gate = gate.clone();
        async move { gate.open(66).await }
    });
    tokio::time::sleep(Duration::from_millis(250)).await;
    assert!(!waiting.is_finished());
    database.execute("ALTER TABLE away RENAME TO run_actions").await;
    waiting.await.expect("no panic").expect("one owner");
    assert!(gate.take_stood() >= Duration::from_millis(200));
    shipper.flush("r").await.expect("one owner");
    assert_eq!(stored(&store, "r").await.len(), 65);
    drop(observer);
    store.close().await;
}

#[tokio::test]
async fn the_ticks_of_an_earlier_owner_are_refused_also_while_the_next_takes_over() {
    let Some(database) = FleetDatabase::new().await else { return };
    let store = database.open().await;
    let shipper = Shipper::start(store.clone()).expect("a thread");
    database.session("s", 1).await;
    database.session("other", 1).await;
    let (held, other) = (Held::new("s".into(), 1), Held::new("other".into(), 1));
    let (mut observer, gate) = shipper.follow("r", &held);
    let (mut bystander, untouched) = shipper.follow("r2", &other);
    let (mut run, mut second) = (run(), run());
    observer.opened(&run);
    bystander.opened(&second);
    play(&mut run, &mut observer, 30);
    shipper.flush("r").await.expect("one owner");
    // The next owner has the row and has not committed: the statement waits for it, and then sees its epoch.
    let take_over = database.take_over_without_commit("s").await;
    play(&mut run, &mut observer, 45);
    play(&mut second, &mut bystander, 12);
    tokio::time::sleep(Duration::from_millis(150)).await;
    assert_eq!((gate.is_lost(), gate.stored()), (false, 30));
    take_over.commit().await;
    gate.lost().await;
    assert!(held.is_lost() && !other.is_lost());
    assert_eq!(gate.open(31).await, Err(Lost));
    assert_eq!(shipper.flush("r").await, Ok(()), "it is not followed any more");
    assert_eq!(stored(&store, "r").await.len(), 30);
    shipper.flush("r2").await.expect("one owner");
    assert_eq!((untouched.stored(), stored(&store, "r2").await.len()), (12, 12));
    drop((observer, bystander));

    // This host becomes the owner again, before its earlier ownership is forgotten.
    let (earlier, _) = shipper.follow("r", &held);
    let (mut again, gate) = shipper.follow("r", &Held::new("s".into(), 2));
    shipper.shared.remove(&earlier.followed);
    again.opened(&run);
    play(&mut run, &mut again, 50);
    shipper.flush("r").await.expect("the owner");
    assert_eq!((gate.stored(), gate.is_lost()), (50, false));
    drop((earlier, again));
    store.close().await;
}

/// What shipping costs on the world's thread, and in the database. Run with
/// `cargo test --release -p palmares-server what_shipping_costs -- --ignored --nocapture`.
#[tokio::test]
#[ignore = "measures; asserts nothing"]
async fn what_shipping_costs() {
    const TICKS: u64 = 3000;
    let backlog = Backlog::new();
    let shared = Arc::new(Shared {
        runs: Mutex::default(),
        wake: Notify::new(),
        rounds: watch::Sender::new(0),
        closed: AtomicBool::new(false),
    });
    let owned = OwnedRun { run_id: "r".into(), held: Held::new("s".into(), 1) };
    let followed =
        Arc::new(Followed { run: owned, backlog, snapshot: Mutex::default(), ended: AtomicBool::new(false) });
    let mut observer =
        ShippingObserver { shared, followed: followed.clone(), snapshot_at: SNAPSHOT_TICKS, snapped: None };
    let mut run = run();
    let (mut copying, mut hashing, mut stepping, mut bytes) = (vec![], vec![], vec![], 0);
    while run.tick() < TICKS {
        let begun = Instant::now();
        step(&mut run);
        // The recorder needs the digest too.
        let (ended, tick) = (Instant::now(), Ticked::of(&run));
        std::hint::black_box(tick.state());
        let stepped = Instant::now();
        observer.ticked(&tick);
        let copied = Instant::now();
        hashing.push(stepped - ended);
        copying.push(copied - stepped);
        stepping.push(ended - begun);
        if run.tick().is_multiple_of(10) {
            bytes += followed.backlog.take().map_or(0, |group| encode(&group.ticks).len());
            followed.backlog.confirm();
        }
    }
    let median = |times: &mut Vec<Duration>| {
        times.sort();
        times[times.len() / 2]
    };
    println!(
        "a tick: {:?} of copying, and {:?} of hashing as for the recorder, beside {:?} of stepping; {} bytes in groups of ten",
        median(&mut copying),
        median(&mut hashing),
        median(&mut stepping),
        bytes / TICKS as usize
    );
}
