//! Official runs in the database, and their verification.

use super::{Archive, Keys, Upload, Verification, stored_path};
use crate::competition::hands::OwnHands;
use palmares_models::hand::Hand;
use palmares_models::measure::HandLimits;
use palmares_net::config::SIGNING_KEY_FILE;
use palmares_replay::forge::rewritten;
use palmares_replay::{Header, Signer};
use palmares_store::files::objects::Objects;
use palmares_store::{
    FIRST_EPOCH, FinishedRunRow, Held, Host, Location, NewAuditEntry, NewRun, NewSession, Store,
};
use palmares_tasks::{Action, BaseTarget, Reason, Run, Seed, Sensing, Task};
use serde_json::{Value, json};
use sqlx::Connection;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tokio::sync::oneshot;

/// The key of a data directory.
fn signer(data_dir: &std::path::Path) -> Signer {
    let text = std::fs::read_to_string(data_dir.join(SIGNING_KEY_FILE)).expect("reads");
    text.parse().expect("a key")
}

struct Place {
    folder: TempDir,
    store: Store,
    archive: Arc<Archive>,
}

impl Place {
    async fn new() -> Self {
        let folder = tempfile::tempdir().expect("folder");
        let store =
            Store::open(&Location::DataDir(folder.path().to_owned()), &Host::alone()).await.expect("store");
        let key = folder.path().join(SIGNING_KEY_FILE);
        let keys = Keys::open(&key, &store, false).await.expect("key");
        let archive = Arc::new(Archive::open(folder.path(), keys, 0).expect("archive"));
        Place { folder, store, archive }
    }

    /// Stores the SHA-256 of another replay of a finished run, at the usual path.
    async fn set_replay(&self, run_id: &str, sha256: &str) {
        let url = format!("sqlite://{}", self.folder.path().join("palmares.sqlite").display());
        let mut connection = sqlx::AnyConnection::connect(&url).await.expect("connects");
        let query = sqlx::query("UPDATE runs SET replay_path = $1, replay_sha256 = $2 WHERE run_id = $3");
        let query = query.bind(format!("replays/{run_id}.mcap")).bind(sha256).bind(run_id);
        assert_eq!(query.execute(&mut connection).await.expect("stored").rows_affected(), 1);
        connection.close().await.expect("closes");
    }

    /// An official run of a few ticks, recorded as by the server, that waits for its verification.
    async fn play(&self, run_id: &str, k: u64) {
        let actions = vec![Action { base: None, hand: Some(vec![0.4, 0.6]), effort: None }; 130];
        self.play_as("crabs", run_id, k, &actions).await;
    }

    async fn play_as(&self, team: &str, run_id: &str, k: u64, actions: &[Action]) {
        let seed = Seed::from_u64(5);
        let (task, hand) =
            (Task::builtin().remove(0), Hand::builtin("pinch").expect("a hand of the program"));
        let session_id = format!("ses_{run_id}");
        let session = NewSession {
            session_id: session_id.clone(),
            team: team.into(),
            client_version: None,
            limit_s: Some(1800.0),
            mode: "official",
            token_hash: None,
        };
        self.store.begin_session(&session, None).await.expect("session");
        let row = NewRun {
            run_id: run_id.into(),
            team: team.into(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            hand_sha256: None,
            mode: "lockstep",
            sensing: Sensing::Truth,
            seed_hex: seed.to_hex(),
            seed: None,
            k: Some(k),
            server_version: "0".into(),
            build_hash: "0".into(),
            header: None,
        };
        let held = Held::new(session_id, FIRST_EPOCH);
        self.store.begin_run(&held, &row).await.expect("run");
        let header =
            Header { k: Some(k), ..Header::new(run_id, team, &task, &hand, seed, 1_700_000_000_000) };
        let mut run = Run::new(task, hand, seed).expect("scene");
        let (mut recorder, recording) = self.archive.record(header);
        palmares_worlds::world::RunObserver::opened(&mut recorder, &run);
        for action in actions {
            run.step(action).expect("valid");
            palmares_worlds::world::RunObserver::ticked(
                &mut recorder,
                &palmares_worlds::world::Ticked::of(&run),
            );
        }
        let outcome = run.finish(Reason::Stopped);
        palmares_worlds::world::RunObserver::finished(&mut recorder, &run, &outcome);
        let file = recording.file().await.expect("written").expect("it has ticks");
        let row = FinishedRunRow {
            held: &held,
            replay: Some((&stored_path(&file), &file.sha256)),
            ended_unix_ms: i64::try_from(file.ended_unix_ms).ok(),
            run_id,
            status: "provisional",
            outcome: &outcome,
            note: None,
            missed_ticks: 0,
            cost_s: (0.0, 0.0),
            clock: None,
        };
        self.store.finish_run(&row).await.expect("stored");
    }

    async fn record(&self, run_id: &str) -> Value {
        let record = self.store.run(run_id).await.expect("query");
        serde_json::to_value(record).expect("JSON")
    }

    /// A verification of this place, with the tasks that it knows and no pause between two tries.
    fn verification(&self, tasks: Vec<Arc<Task>>) -> Verification {
        let verification =
            Verification::new(self.store.clone(), self.archive.clone(), Arc::default(), tasks.into());
        let mut verification = verification.expect("randomness");
        verification.pauses = [Duration::ZERO; 4];
        verification
    }

    /// Verifies until a run no longer waits; returns its status and note.
    async fn verified(&self, run_id: &str) -> (String, String) {
        let (stop, stopping) = oneshot::channel::<()>();
        let verification = self.verification(Vec::new()).run(async {
            let _ = stopping.await;
        });
        let verification = tokio::spawn(verification);
        let start = Instant::now();
        let record = loop {
            let record = self.record(run_id).await;
            if record["verify_state"] != "waiting" {
                break record;
            }
            assert!(start.elapsed() < Duration::from_secs(300), "not verified in time");
            tokio::time::sleep(Duration::from_millis(20)).await;
        };
        drop(stop);
        verification.await.expect("ended");
        let text = |field: &str| record[field].as_str().unwrap_or_default().to_owned();
        (text("status"), text("verify_note"))
    }

    /// Tries to verify a run, with these tasks, until it has a verdict or is stuck; returns status, state and problem.
    async fn tried(&self, run_id: &str, tasks: Vec<Arc<Task>>) -> (String, String, String) {
        let verification = self.verification(tasks);
        loop {
            verification.round(true).await.expect("database");
            let record = self.record(run_id).await;
            if record["verify_state"] != "waiting" {
                let text = |field: &str| record[field].as_str().unwrap_or_default().to_owned();
                return (text("status"), text("verify_state"), text("verify_problem"));
            }
        }
    }

    /// An organizer's order to verify a run again.
    async fn reverify(&self, run_id: &str) {
        let entry = NewAuditEntry { actor: "test", action: "run.reverify", subject: run_id, reason: None };
        assert!(self.store.reverify(run_id, &entry).await.expect("query"), "{run_id}");
    }

    async fn leaderboard(&self) -> usize {
        self.store.leaderboard(true).await.expect("query").len()
    }

    fn path(&self, run_id: &str) -> std::path::PathBuf {
        self.folder.path().join("replays").join(format!("{run_id}.mcap"))
    }
}

#[tokio::test]
async fn a_provisional_run_becomes_verified() {
    let place = Place::new().await;
    place.play("run_1", 1).await;
    assert_eq!(place.record("run_1").await["status"], "provisional");
    assert_eq!(place.verified("run_1").await, ("verified".into(), "130 ticks, 132 states equal".into()));
    // Official replays stay, however few practice ones are kept.
    assert!(place.path("run_1").exists());
    // On request, it is verified again; it keeps its status until the verdict.
    place.reverify("run_1").await;
    let record = place.record("run_1").await;
    assert_eq!((&record["status"], &record["verify_state"]), (&json!("verified"), &json!("waiting")));
    // Someone changes an action in the file; the records before and after it stay as they were signed.
    let bytes = std::fs::read(place.path("run_1")).expect("file");
    let change = |topic: &str, text: &str| {
        if topic == "/action" { text.replace("{\"tick\":42,\"", "{\"tick\":43,\"") } else { text.into() }
    };
    let changed = rewritten(&bytes, &change, false, &signer(place.folder.path()));
    std::fs::write(place.path("run_1"), changed).expect("written");
    let (status, note) = place.verified("run_1").await;
    assert_eq!(status, "rejected");
    assert!(note.starts_with("chain_broken"), "{note}");
}

#[tokio::test]
async fn a_run_without_a_tick_leaves_no_replay() {
    let place = Place::new().await;
    let (task, hand) = (Task::builtin().remove(0), Hand::builtin("pinch").expect("a hand of the program"));
    let header = Header::new("run_0", "crabs", &task, &hand, Seed::from_u64(5), 1_700_000_000_000);
    let mut run = Run::new(task, hand, Seed::from_u64(5)).expect("scene");
    let (mut recorder, recording) = place.archive.record(header);
    palmares_worlds::world::RunObserver::opened(&mut recorder, &run);
    assert!(place.path("run_0").exists());
    let outcome = run.finish(Reason::Stopped);
    palmares_worlds::world::RunObserver::finished(&mut recorder, &run, &outcome);
    assert_eq!(recording.file().await, Ok(None));
    assert!(!place.path("run_0").exists());
}

#[tokio::test]
async fn a_run_that_does_not_replay_is_rejected_with_the_reason() {
    let place = Place::new().await;
    for (k, run_id) in ["run_other", "run_forged", "run_stranger"].into_iter().enumerate() {
        place.play(run_id, k as u64 + 1).await;
    }
    // Another run's replay, sound in itself.
    place.play("run_good", 9).await;
    let good = std::fs::read(place.path("run_good")).expect("file");
    std::fs::write(place.path("run_other"), &good).expect("written");
    // A changed action with the right key, and an unchanged run with another key.
    let bytes = std::fs::read(place.path("run_forged")).expect("file");
    let signer = signer(place.folder.path());
    let change = |topic: &str, text: &str| {
        if topic == "/action" && text.starts_with("{\"tick\":42,") {
            text.replace("0.4,0.6", "0.4,0.7")
        } else {
            text.into()
        }
    };
    let forged = rewritten(&bytes, &change, true, &signer);
    std::fs::write(place.path("run_forged"), &forged).expect("written");
    let stranger = rewritten(&bytes, &|_, text| text.into(), true, &Signer::random().expect("key"));
    std::fs::write(place.path("run_stranger"), &stranger).expect("written");
    for (run_id, bytes) in [("run_other", &good), ("run_forged", &forged), ("run_stranger", &stranger)] {
        place.reverify(run_id).await;
        let sha256 = palmares_net::auth::sha256_hex(bytes);
        place.set_replay(run_id, &sha256).await;
    }
    let (status, note) = place.verified("run_forged").await;
    assert_eq!(status, "rejected");
    assert!(note.starts_with("state_differs: the state at tick 43"), "{note}");
    let (_, note) = place.verified("run_other").await;
    assert!(note.starts_with("score_differs: run_id is"), "{note}");
    let (_, note) = place.verified("run_stranger").await;
    assert!(note.starts_with("bad_signature: signed by"), "{note}");
    assert_eq!(place.verified("run_good").await.0, "verified");
    assert_eq!(place.record("run_good").await["k"], json!(9));
}

#[tokio::test]
async fn a_run_that_cannot_be_judged_here_keeps_its_status() {
    let place = Place::new().await;
    place.play("run_1", 1).await;
    place.play_as("eels", "run_2", 1, &vec![Action::default(); 20]).await;
    assert_eq!(place.verified("run_1").await.0, "verified");
    assert_eq!(place.verified("run_2").await.0, "verified");
    place.reverify("run_1").await;
    place.reverify("run_2").await;
    let kept = place.folder.path().join("kept");
    std::fs::rename(place.folder.path().join("replays"), &kept).expect("renamed");
    for run_id in ["run_1", "run_2"] {
        let (status, state, problem) = place.tried(run_id, Vec::new()).await;
        assert_eq!((status.as_str(), state.as_str()), ("verified", "stuck"), "{run_id}");
        assert!(problem.starts_with("missing_file: "), "{problem}");
    }
    assert_eq!(place.leaderboard().await, 2);
    let queue = place.store.verification_queue().await.expect("query");
    assert_eq!((queue.waiting, queue.stuck), (0, 2));
    // The directory is back, and the organizer orders another verification.
    std::fs::rename(&kept, place.folder.path().join("replays")).expect("renamed");
    place.reverify("run_1").await;
    let verified = ("verified".into(), String::new(), String::new());
    assert_eq!(place.tried("run_1", Vec::new()).await, verified);
}

#[tokio::test]
async fn another_engine_or_task_is_no_verdict() {
    let place = Place::new().await;
    place.play("run_1", 1).await;
    let signer = signer(place.folder.path());
    let bytes = std::fs::read(place.path("run_1")).expect("file");
    let engine = palmares_tasks::identity::engine();
    let task = Task::builtin().remove(0).content_hash().to_owned();
    for (place_in_header, part) in [(engine, "other_engine: recorded by engine"), (task, "other_task: ")] {
        let change =
            move |_: &str, text: &str| if text == place_in_header { "0".repeat(16) } else { text.into() };
        let other = rewritten(&bytes, &change, true, &signer);
        std::fs::write(place.path("run_1"), &other).expect("written");
        let sha256 = palmares_net::auth::sha256_hex(&other);
        place.set_replay("run_1", &sha256).await;
        place.reverify("run_1").await;
        let (status, state, problem) = place.tried("run_1", Vec::new()).await;
        assert_eq!((status.as_str(), state.as_str()), ("provisional", "stuck"));
        assert!(problem.contains(part), "{problem}");
    }
    assert_eq!(place.leaderboard().await, 1);
}

/// The actions of a controller that visits places (m) in turn and closes and opens the hand there, at 10 mm a tick.
fn visiting(places: &[[f64; 3]]) -> Vec<Action> {
    let mut actions = Vec::new();
    let mut at = [0.0, 0.0, 0.75];
    for (number, to) in places.iter().enumerate() {
        let way: f64 = (0..3).map(|k| (to[k] - at[k]) * (to[k] - at[k])).sum::<f64>().sqrt();
        let ticks = (way / 0.01).ceil() as u32 + 20;
        for tick in 1..=ticks {
            let part = (f64::from(tick) / (way / 0.01)).min(1.0);
            let position = [0, 1, 2].map(|k| at[k] + part * (to[k] - at[k]));
            let base = BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
            actions.push(Action { base: Some(base), hand: Some(vec![(number % 2) as f64; 2]), effort: None });
        }
        at = *to;
    }
    actions
}

#[tokio::test]
async fn runs_of_two_teams_with_the_same_movements_are_reported() {
    let place = Place::new().await;
    let actions = visiting(&[[0.1, 0.1, 0.6], [-0.2, 0.1, 0.6], [0.0, -0.2, 0.7]]);
    // A copy that comes later, with noise.
    let mut later = [vec![actions[0].clone(); 37], actions.clone()].concat();
    for (k, action) in later.iter_mut().enumerate() {
        if let Some(BaseTarget::Pose { position, .. }) = &mut action.base {
            position[k % 3] += if k % 2 == 0 { 1.2e-4 } else { -1.2e-4 };
        }
    }
    let honest = visiting(&[[0.2, -0.1, 0.6], [0.2, 0.2, 0.7], [0.0, 0.0, 0.6]]);
    let idle = vec![Action::default(); 50];
    for (team, run_id, k, actions) in [
        ("crabs", "run_1", 1, &actions),
        ("eels", "run_2", 1, &later),
        ("crabs", "run_3", 2, &actions),
        ("newts", "run_4", 1, &honest),
        ("crabs", "run_5", 3, &idle),
        ("newts", "run_6", 3, &idle),
    ] {
        place.play_as(team, run_id, k, actions).await;
        assert_eq!(place.verified(run_id).await.0, "verified", "{run_id}");
    }
    let similar = async |run_id: &str| {
        let record = place.record(run_id).await;
        let found = record["similar"].as_array().cloned().unwrap_or_default();
        found.iter().map(|other| (other["team"].clone(), other["run_id"].clone())).collect::<Vec<_>>()
    };
    let pair = |team: &str, run_id: &str| (json!(team), json!(run_id));
    let reported = async || {
        assert_eq!(similar("run_1").await, [pair("eels", "run_2")]);
        assert_eq!(similar("run_2").await, [pair("crabs", "run_1")]);
        // Another k is another scene.
        for run_id in ["run_3", "run_4", "run_5", "run_6"] {
            assert_eq!(similar(run_id).await, [], "{run_id}");
        }
    };
    reported().await;
    // Verified again, it is reported once.
    place.reverify("run_2").await;
    assert_eq!(place.verified("run_2").await.0, "verified");
    reported().await;
    let audit = place.store.audit(0, 100).await.expect("query");
    assert_eq!(audit.iter().map(|entry| entry.action.as_str()).collect::<Vec<_>>(), ["run.reverify"]);
}

#[tokio::test]
async fn a_replay_in_the_shared_storage_is_read_where_it_is_missing() {
    let mut place = Place::new().await;
    let season = place.folder.path().join("season");
    let objects = Some(Arc::new(Objects::open(&format!("file://{}", season.display())).expect("opens")));
    let key = place.folder.path().join(SIGNING_KEY_FILE);
    let keys = Keys::open(&key, &place.store, false).await.expect("key");
    let archive = Archive::open(place.folder.path(), keys, 0).expect("archive").sharing(objects.clone());
    place.archive = Arc::new(archive);
    let hands = OwnHands::new(place.folder.path(), HandLimits::default(), Vec::new(), objects);
    let upload = Upload::new(place.store.clone(), place.archive.clone(), Arc::new(hands));
    let mut upload = upload.expect("it has a storage");

    // The storage is away: the replay waits, and stays in the data directory.
    place.play("run_1", 1).await;
    std::fs::write(&season, "no folder").expect("written");
    upload.round().await.expect_err("away");
    let waiting = place.store.unstored_replays().await.expect("query");
    assert_eq!(waiting.iter().map(|replay| replay.run_id.as_str()).collect::<Vec<_>>(), ["run_1"]);
    assert_eq!(place.verified("run_1").await.0, "verified");
    assert!(place.path("run_1").exists());

    // It is back: the replay is in it by its content, and the data directory keeps no copy beyond the limit.
    std::fs::remove_file(&season).expect("removed");
    upload.round().await.expect("uploads");
    assert!(place.store.unstored_replays().await.expect("query").is_empty());
    let sha256 = waiting[0].replay_sha256.clone();
    assert!(season.join("replays").join(format!("{sha256}.mcap")).exists());
    place.verification(Vec::new()).round(true).await.expect("cleans");
    assert!(!place.path("run_1").exists());

    // A verification reads it from there, and keeps it. A changed copy here does not count beside it.
    for changed in [false, true] {
        place.reverify("run_1").await;
        if changed {
            std::fs::write(place.path("run_1"), "changed").expect("written");
        }
        let verification = place.verification(Vec::new());
        verification.round(false).await.expect("database");
        assert_eq!(place.record("run_1").await["status"], "verified");
        let kept = std::fs::read(place.path("run_1")).expect("kept here");
        assert_eq!(palmares_net::auth::sha256_hex(&kept), sha256);
    }
    // A changed file is never uploaded.
    place.play("run_2", 2).await;
    std::fs::write(place.path("run_2"), "changed").expect("written");
    upload.round().await.expect("leaves it");
    assert_eq!(place.store.unstored_replays().await.expect("query").len(), 1);
    assert_eq!(std::fs::read_dir(season.join("replays")).expect("folder").count(), 1);
}
